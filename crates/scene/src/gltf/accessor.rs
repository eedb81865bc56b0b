//! Accessors: typed, bounds-checked and possibly sparse views into buffers.
//!
//! Every length is checked against the bytes that exist before memory is allocated.

use super::json::{Accessor, Root};
use super::source::Bytes;
use crate::error::{At, Fault, invalid};
use crate::limits::{self, Budget};

/// Reads the accessors of one glTF.
#[derive(Clone, Copy)]
pub(super) struct Accessors<'a> {
    pub(super) root: &'a Root,
    pub(super) buffers: &'a [Bytes],
    pub(super) budget: &'a Budget,
}

/// The storage format of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn new(code: u32) -> Result<Self, Fault> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(invalid(format!("unknown componentType {code}"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// One component as a float; normalised integers as in glTF 2.0, section 3.11.
    fn float(self, b: &[u8], normalized: bool) -> f32 {
        let (value, largest) = match self {
            Self::I8 => (f32::from(b[0] as i8), 127.0),
            Self::U8 => (f32::from(b[0]), 255.0),
            Self::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32_767.0),
            Self::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65_535.0),
            Self::U32 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, u32::MAX as f32),
            Self::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }

    /// One component as an unsigned integer; `None` for other formats.
    fn integer(self, b: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(u32::from(b[0])),
            Self::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
            Self::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::I8 | Self::I16 | Self::F32 => None,
        }
    }
}

fn components(kind: &str) -> Option<usize> {
    Some(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => return None,
    })
}

/// Elements in a buffer at a stride.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    element: usize,
    count: usize,
}

impl<'a> Strided<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (bytes, stride, element) = (self.bytes, self.stride, self.element);
        (0..self.count).map(move |i| &bytes[i * stride..][..element])
    }
}

impl<'a> Accessors<'a> {
    /// The elements of an accessor as floats, `N` components each.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, Fault> {
        self.read(index, |component, accessor| {
            let (size, normalized) = (component.size(), accessor.normalized);
            move |bytes: &[u8]| {
                Ok(std::array::from_fn(|i| component.float(&bytes[i * size..], normalized)))
            }
        })
    }

    /// The elements of an accessor as unsigned integers, `N` components each.
    pub(super) fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Fault> {
        self.read(index, |component, _| {
            let size = component.size();
            move |bytes: &[u8]| {
                let mut element = [0; N];
                for (i, value) in element.iter_mut().enumerate() {
                    *value = component.integer(&bytes[i * size..]).ok_or_else(|| {
                        invalid(format!("unsigned integers are needed, not {component:?}"))
                    })?;
                }
                Ok(element)
            }
        })
    }

    /// Number of elements that an accessor declares.
    pub(super) fn count(&self, index: usize) -> Result<u64, Fault> {
        self.accessor(index).map(|a| a.count)
    }

    /// Number of components of an element.
    pub(super) fn components(&self, index: usize) -> Result<usize, Fault> {
        let accessor = self.accessor(index)?;
        components(&accessor.kind).ok_or_else(|| invalid(format!("type {:?}", accessor.kind)))
    }

    fn accessor(&self, index: usize) -> Result<&'a Accessor, Fault> {
        let there = self.root.accessors.len();
        self.root
            .accessors
            .get(index)
            .ok_or_else(|| invalid(format!("accessor {index} of {there} does not exist")))
    }

    fn read<const N: usize, T, R>(
        &self,
        index: usize,
        reader: impl Fn(Component, &Accessor) -> R,
    ) -> Result<Vec<[T; N]>, Fault>
    where
        T: Copy + Default,
        R: Fn(&[u8]) -> Result<[T; N], Fault>,
    {
        let accessor = self.accessor(index)?;
        let read = || -> Result<_, Fault> {
            let component = Component::new(accessor.component_type)?;
            if components(&accessor.kind) != Some(N) {
                let kind = &accessor.kind;
                return Err(invalid(format!("{N} components are needed, its type is {kind}")));
            }
            let element = N * component.size();
            let read = reader(component, accessor);
            let mut values: Vec<[T; N]> = match accessor.buffer_view {
                Some(view) => {
                    let stored =
                        self.strided(view, accessor.byte_offset, element, accessor.count)?;
                    self.budget.geometry::<[T; N]>(stored.count)?;
                    stored.iter().map(&read).collect::<Result<_, _>>()?
                }
                None => {
                    if accessor.count > limits::ZERO_ELEMENTS {
                        let what = "elements without a buffer".into();
                        return Err(Fault::TooLarge { what, limit: limits::ZERO_ELEMENTS });
                    }
                    self.budget.geometry::<[T; N]>(accessor.count as usize)?;
                    vec![[T::default(); N]; accessor.count as usize]
                }
            };
            self.replace_sparse(accessor, element, &read, &mut values)?;
            Ok(values)
        };
        read().at(|| format!("accessor {index}"))
    }

    fn replace_sparse<const N: usize, T>(
        &self,
        accessor: &Accessor,
        element: usize,
        read: &impl Fn(&[u8]) -> Result<[T; N], Fault>,
        values: &mut [[T; N]],
    ) -> Result<(), Fault> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let (at, new) = (&sparse.indices, &sparse.values);
        let component = Component::new(at.component_type)?;
        let indices =
            self.strided(at.buffer_view, at.byte_offset, component.size(), sparse.count)?;
        let stored = self.strided(new.buffer_view, new.byte_offset, element, sparse.count)?;
        for (index, bytes) in indices.iter().zip(stored.iter()) {
            let index = component
                .integer(index)
                .ok_or_else(|| invalid("sparse indices have to be unsigned integers"))?;
            let value = values
                .get_mut(index as usize)
                .ok_or_else(|| invalid(format!("sparse index {index} is past its end")))?;
            *value = read(bytes)?;
        }
        Ok(())
    }

    /// Finds the bytes of `count` elements and checks that all exist.
    fn strided(
        &self,
        view_index: usize,
        offset: u64,
        element: usize,
        count: u64,
    ) -> Result<Strided<'a>, Fault> {
        let bytes = self.view(view_index)?;
        let stride = self.root.buffer_views[view_index].byte_stride.unwrap_or(element as u64);
        if stride < element as u64 || stride > 252.max(element as u64) {
            return Err(invalid(format!("bufferView {view_index} has the byteStride {stride}")));
        }
        let past = || {
            let there = bytes.len();
            invalid(format!(
                "{count} elements do not fit into bufferView {view_index} of {there} bytes; the \
                 file is cut off or was written wrongly"
            ))
        };
        let count = usize::try_from(count).map_err(|_| past())?;
        let from = usize::try_from(offset).map_err(|_| past())?;
        let bytes_from = bytes.get(from..).ok_or_else(past)?;
        let needed = match count.checked_sub(1) {
            None => Some(0),
            Some(before_last) => {
                before_last.checked_mul(stride as usize).and_then(|n| n.checked_add(element))
            }
        };
        if needed.is_none_or(|needed| needed > bytes_from.len()) {
            return Err(past());
        }
        Ok(Strided { bytes: bytes_from, stride: stride as usize, element, count })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize) -> Result<&'a [u8], Fault> {
        let there = self.root.buffer_views.len();
        let view = self
            .root
            .buffer_views
            .get(index)
            .ok_or_else(|| invalid(format!("bufferView {index} of {there} does not exist")))?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(|| {
            invalid(format!("bufferView {index}: buffer {} does not exist", view.buffer))
        })?;
        let range = usize::try_from(view.byte_offset).ok().and_then(|start| {
            let end = start.checked_add(usize::try_from(view.byte_length).ok()?)?;
            Some(start..end)
        });
        range.and_then(|range| buffer.get(range)).ok_or_else(|| {
            invalid(format!(
                "bufferView {index} reaches past the end of buffer {} ({} bytes)",
                view.buffer,
                buffer.len()
            ))
        })
    }
}
