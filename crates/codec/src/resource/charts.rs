//! Charts as bytes (docs/wire.md, "Charts").

use glam::{I64Vec2, UVec2};
use lumencast_light::{ChartVertex, Charts};

use crate::bytes::{Reader, put_varint, put_zigzag, unzigzag, zigzag};
use crate::{DecodeError, limits};

const VERSION: u64 = 1;
/// Steps of coordinates in a lumel.
const STEPS: f32 = 256.0;

/// The bytes of charts, whose coordinates are rounded to 1/256 lumel.
///
/// # Panics
/// If a vertex has no rectangle.
pub(super) fn write_charts(charts: &Charts) -> Vec<u8> {
    let mut out = Vec::with_capacity(16 + 8 * charts.vertices.len() + 4 * charts.triangles.len());
    put_varint(&mut out, VERSION);
    put_varint(&mut out, charts.sizes.len() as u64);
    for size in &charts.sizes {
        put_varint(&mut out, size.x.into());
        put_varint(&mut out, size.y.into());
    }
    put_varint(&mut out, charts.vertices.len() as u64);
    let (mut last_source, mut last_at) = (0, I64Vec2::ZERO);
    for vertex in &charts.vertices {
        let source = i64::from(vertex.source);
        let most = steps(charts.sizes[vertex.rectangle as usize]);
        let at = (STEPS * vertex.at).round().as_i64vec2().clamp(I64Vec2::ZERO, most);
        put_zigzag(&mut out, source - last_source);
        put_varint(&mut out, vertex.rectangle.into());
        put_zigzag(&mut out, at.x - last_at.x);
        put_zigzag(&mut out, at.y - last_at.y);
        (last_source, last_at) = (source, at);
    }
    put_varint(&mut out, charts.triangles.len() as u64);
    let mut last = 0;
    for triangle in &charts.triangles {
        if *triangle == Charts::NOWHERE {
            put_varint(&mut out, 0);
            continue;
        }
        let [a, b, c] = triangle.map(i64::from);
        put_varint(&mut out, 1 + zigzag(a - last));
        put_zigzag(&mut out, b - a);
        put_zigzag(&mut out, c - a);
        last = a;
    }
    out
}

/// Reads charts.
///
/// # Errors
/// [`DecodeError`] when the bytes are no charts of this version, exceed a limit or contradict
/// themselves.
pub fn read_charts(bytes: &[u8]) -> Result<Charts, DecodeError> {
    let mut reader = super::reader(bytes, VERSION)?;
    let mut charts = Charts::default();
    for _ in 0..reader.count(2)? {
        charts.sizes.push(UVec2::new(side(&mut reader)?, side(&mut reader)?));
    }
    let vertices = reader.count(4)?;
    charts.vertices.reserve_exact(vertices);
    let (mut source, mut at) = (0, I64Vec2::ZERO);
    for _ in 0..vertices {
        source += reader.zigzag()?;
        let rectangle = reader.number()?;
        at += I64Vec2::new(reader.zigzag()?, reader.zigzag()?);
        let size = charts.sizes.get(rectangle as usize);
        let size = *size.ok_or(DecodeError::Malformed("a vertex without a rectangle"))?;
        if at.cmplt(I64Vec2::ZERO).any() || at.cmpgt(steps(size)).any() {
            return Err(DecodeError::Malformed("a vertex outside its rectangle"));
        }
        let own = u32::try_from(source).map_err(|_| DecodeError::Malformed("a vertex's source"))?;
        charts.vertices.push(ChartVertex { source: own, rectangle, at: at.as_vec2() / STEPS });
    }
    let triangles = reader.count(1)?;
    charts.triangles.reserve_exact(triangles);
    let mut last = 0;
    for _ in 0..triangles {
        let Some(first) = reader.varint()?.checked_sub(1) else {
            charts.triangles.push(Charts::NOWHERE);
            continue;
        };
        last += unzigzag(first);
        let corners = [last, last + reader.zigzag()?, last + reader.zigzag()?];
        charts.triangles.push(triangle(corners, &charts.vertices)?);
    }
    super::at_end(&reader)?;
    Ok(charts)
}

/// A triangle of vertices that there are, in one rectangle.
fn triangle(corners: [i64; 3], vertices: &[ChartVertex]) -> Result<[u32; 3], DecodeError> {
    let vertex = |corner: i64| usize::try_from(corner).ok().and_then(|corner| vertices.get(corner));
    let [Some(a), Some(b), Some(c)] = corners.map(vertex) else {
        return Err(DecodeError::Malformed("a triangle without a vertex"));
    };
    if a.rectangle != b.rectangle || a.rectangle != c.rectangle {
        return Err(DecodeError::Malformed("a triangle in several rectangles"));
    }
    Ok(corners.map(|corner| corner as u32))
}

/// A rectangle's size in steps of coordinates.
fn steps(size: UVec2) -> I64Vec2 {
    size.as_i64vec2() * STEPS as i64
}

fn side(reader: &mut Reader<'_>) -> Result<u32, DecodeError> {
    let side = reader.number()?;
    let most = limits::PAGE_LUMELS as usize;
    DecodeError::limit("lumels of a rectangle along a side", side as usize, most)?;
    if side == 0 {
        return Err(DecodeError::Malformed("an empty rectangle"));
    }
    Ok(side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn vertex(source: u32, rectangle: u32, x: f32, y: f32) -> ChartVertex {
        ChartVertex { source, rectangle, at: Vec2::new(x, y) }
    }

    fn charts() -> Charts {
        Charts {
            sizes: vec![UVec2::new(8, 12), UVec2::new(4096, 1)],
            vertices: vec![
                vertex(9, 0, 0.0, 12.0),
                vertex(u32::MAX, 0, 8.0, 0.5),
                vertex(0, 0, 2.0 + 1.0 / 256.0, 3.5),
                vertex(7, 1, 4095.5, 0.25),
                vertex(7, 1, 0.0, 1.0),
            ],
            triangles: vec![[2, 0, 1], Charts::NOWHERE, [3, 4, 4], [0, 1, 2]],
        }
    }

    #[test]
    fn charts_round_trip() {
        for charts in [charts(), Charts::default()] {
            assert_eq!(read_charts(&write_charts(&charts)), Ok(charts));
        }
    }

    #[test]
    fn coordinates_are_rounded_and_stay_within() {
        let mut rough = charts();
        rough.vertices[0].at = Vec2::new(-0.001, 12.0001);
        rough.vertices[2].at.y += 0.001;
        assert_eq!(read_charts(&write_charts(&rough)), Ok(charts()));
    }

    #[test]
    fn contradictions_are_refused() {
        let good = charts();
        let turned = |turn: &dyn Fn(&mut Charts)| {
            let mut turned = good.clone();
            turn(&mut turned);
            read_charts(&write_charts(&turned)).map_err(|error| error.kind())
        };
        assert_eq!(turned(&|_| ()), Ok(good.clone()));
        assert_eq!(turned(&|c| c.triangles[0] = [0, 1, 3]), Err("malformed"), "two rectangles");
        assert_eq!(turned(&|c| c.triangles[0] = [0, 1, 5]), Err("malformed"), "no vertex");
        assert_eq!(turned(&|c| c.sizes[1].y = 0), Err("malformed"));
        assert_eq!(turned(&|c| c.sizes[1].x = 4097), Err("limit"));
        let bytes = write_charts(&good);
        for length in 0..bytes.len() {
            let error = read_charts(&bytes[..length]).map_err(|error| error.kind());
            assert_eq!(error, Err("truncated"), "{length}");
        }
        let read = |bytes: &[u8]| read_charts(bytes).map_err(|error| error.kind());
        assert_eq!(read(&[&bytes[..], &[0]].concat()), Err("malformed"), "bytes after the end");
        assert_eq!(read(&[&[2], &bytes[1..]].concat()), Err("version"));
        // One rectangle of 1 × 1; one vertex of its rectangle 1, at (2, 0), at (−1, 0), of source −1.
        assert_eq!(read(&[1, 1, 1, 1, 1, 0, 0, 128, 4, 0, 0]).map(drop), Ok(()), "at (1, 0)");
        for vertex in [&[0, 1, 0, 0][..], &[0, 0, 128, 8, 0], &[0, 0, 1, 0], &[1, 0, 0, 0]] {
            assert_eq!(read(&[&[1, 1, 1, 1, 1], vertex, &[0]].concat()), Err("malformed"));
        }
    }

    /// Counts beyond what the bytes that are left can hold.
    #[test]
    fn claims_allocate_nothing() {
        let mut claim = vec![1];
        put_varint(&mut claim, 1 << 40);
        assert_eq!(read_charts(&claim).map_err(|error| error.kind()), Err("truncated"));
        let many = vec![1; limits::RESOURCE_BYTES + 1];
        assert_eq!(read_charts(&many).map_err(|error| error.kind()), Err("limit"));
    }
}
