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
    fn overlong_varints_are_refused() {
        assert_eq!(Reader(&[0x80; 4]).varint(), Err(DecodeError::Truncated));
        assert!(matches!(Reader(&[0x80; 10]).varint(), Err(DecodeError::Malformed(_))));
        assert!(matches!(
            Reader(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F]).varint(),
            Err(DecodeError::Malformed(_))
        ));
    }
}
