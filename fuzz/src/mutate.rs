//! Mutations of bytes, the same for the same number.

/// Random numbers: SplitMix64.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Numbers that follow from one.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A whole number below `end`, which is at least 1.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % end as u64) as usize
    }
}

/// What decoders like least, as bytes and in JSON.
const TOKENS: [&[u8]; 16] = [
    b"0",
    b"-1",
    b"0.5",
    b"1e39",
    b"1e308",
    b"-1e-320",
    b"4294967296",
    b"9007199254740992",
    b"18446744073709551616",
    b"null",
    b"[]",
    b"{}",
    b"\"\"",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x00",
    b"\n",
];

/// One to four changes of a seed: bytes turned, cut out, doubled, numbers exchanged, parts of another
/// seed put in.
pub fn mutated(seed: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + random.below(16)).min(bytes.len());
        match random.below(7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < bytes.len() => bytes[at] = random.below(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let doubled = bytes[at..end].to_vec();
                bytes.splice(at..at, doubled);
            }
            4 => drop(bytes.splice(at..at, TOKENS[random.below(TOKENS.len())].iter().copied())),
            5 => exchange_number(&mut bytes, at, TOKENS[random.below(TOKENS.len())]),
            _ => {
                let from = random.below(other.len() + 1);
                let to = (from + random.below(200)).min(other.len());
                bytes.splice(at..end, other[from..to].iter().copied());
            }
        }
    }
    bytes
}

/// Puts a token in the place of the next number written in digits.
fn exchange_number(bytes: &mut Vec<u8>, from: usize, token: &[u8]) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"-.".contains(byte);
    if let Some(start) = bytes[from..].iter().position(is_part) {
        let start = from + start;
        let length = bytes[start..].iter().take_while(|byte| is_part(byte)).count();
        bytes.splice(start..start + length, token.iter().copied());
    }
}
