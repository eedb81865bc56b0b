//! Reading and writing of little-endian numbers and varints (unsigned LEB128).

use crate::DecodeError;

/// Reads from the front of a byte slice.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    pub(crate) fn take(&mut self, n: usize) -> Result<&'a [u8], DecodeError> {
        let (head, rest) = self.0.split_at_checked(n).ok_or(DecodeError::Truncated)?;
        self.0 = rest;
        Ok(head)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, DecodeError> {
        Ok(self.take(1)?[0])
    }

    pub(crate) fn f64(&mut self) -> Result<f64, DecodeError> {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(self.take(8)?);
        Ok(f64::from_le_bytes(bytes))
    }

    /// An integer below 2^53, so that JavaScript holds it exactly.
    pub(crate) fn varint(&mut self) -> Result<u64, DecodeError> {
        let mut value = 0_u64;
        for shift in (0..56).step_by(7) {
            let byte = self.u8()?;
            value |= u64::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return if value < 1 << 53 {
                    Ok(value)
                } else {
                    Err(DecodeError::Malformed("a varint of 2^53 or more"))
                };
            }
        }
        Err(DecodeError::Malformed("a varint of more than 8 bytes"))
    }

    /// A varint below 2^32.
    pub(crate) fn number(&mut self) -> Result<u32, DecodeError> {
        let value = self.varint()?;
        u32::try_from(value).map_err(|_| DecodeError::Malformed("a number of 2^32 or more"))
    }

    /// A signed number: 0, −1, 1, −2, … as 0, 1, 2, 3, ….
    pub(crate) fn zigzag(&mut self) -> Result<i64, DecodeError> {
        self.varint().map(unzigzag)
    }

    /// How many things follow of so many bytes each, at least. What is allocated for them is bounded by
    /// the bytes that are left.
    pub(crate) fn count(&mut self, bytes_each: usize) -> Result<usize, DecodeError> {
        let count = usize::try_from(self.varint()?).unwrap_or(usize::MAX);
        if count > self.0.len() / bytes_each {
            return Err(DecodeError::Truncated);
        }
        Ok(count)
    }
}

/// The signed number that a zigzag varint stands for.
pub(crate) fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

/// A signed number as a zigzag varint has it.
pub(crate) fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63) as u64
}

/// Appends a signed number of magnitude below 2^52.
pub(crate) fn put_zigzag(out: &mut Vec<u8>, value: i64) {
    put_varint(out, zigzag(value));
}

/// Appends a varint; values of 2^53 and more saturate (no count of ours gets there).
pub(crate) fn put_varint(out: &mut Vec<u8>, value: u64) {
    let mut value = value.min((1 << 53) - 1);
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn varints_round_trip() {
        for value in [0, 1, 127, 128, 300, u64::from(u32::MAX), (1 << 53) - 1] {
            let mut out = Vec::new();
            put_varint(&mut out, value);
            let mut reader = Reader(&out);
            assert_eq!(reader.varint(), Ok(value));
            assert!(reader.0.is_empty());
        }
    }

    #[test]
    fn signed_numbers_round_trip() {
        for (value, becomes) in [(0, 0), (-1, 1), (1, 2), (-2, 3)] {
            assert_eq!((zigzag(value), unzigzag(becomes)), (becomes, value));
        }
        for value in [0, -1, 64, -65, u32::MAX.into(), -i64::from(u32::MAX), (1 << 52) - 1] {
            let mut out = Vec::new();
            put_zigzag(&mut out, value);
            assert_eq!(Reader(&out).zigzag(), Ok(value));
        }
    }

    #[test]
    fn overlong_varints_are_refused() {
        assert_eq!(Reader(&[0x80; 4]).varint(), Err(DecodeError::Truncated));
        assert!(matches!(Reader(&[0x80; 10]).varint(), Err(DecodeError::Malformed(_))));
        assert!(matches!(
            Reader(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F]).varint(),
            Err(DecodeError::Malformed(_))
        ));
    }
}
