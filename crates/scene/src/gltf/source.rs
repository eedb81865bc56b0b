//! Sources of a glTF's bytes: its container, and the files that it refers to.
//!
//! Only files in the scene's folder are read. A URI may not be absolute, name another machine,
//! climb with `..`, or reach out through a symbolic link.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

use crate::error::{Fault, invalid};
use crate::limits;

/// Reads a regular file of at most `most` bytes.
pub(crate) fn read_file(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    // Opening a pipe would wait for its writer.
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let too_large =
        || io::Error::new(io::ErrorKind::FileTooLarge, format!("larger than {most} bytes"));
    if length > most {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // The file may grow while it is read.
    match file.take(most + 1).read_to_end(&mut bytes)? as u64 > most {
        true => Err(too_large()),
        false => Ok(bytes),
    }
}

/// The folder of a scene, and the folder within it that URIs are relative to.
#[derive(Clone, Debug)]
pub(crate) struct Folder {
    /// The scene's folder with links resolved.
    canonical: PathBuf,
    given: PathBuf,
    /// Folder of the referring file, relative to the scene's folder: empty, or with `/` at the end.
    prefix: String,
    /// Largest size of a file, bytes.
    most: u64,
}

impl Folder {
    /// The folder of a scene's file.
    pub(crate) fn of(file: &Path) -> io::Result<Self> {
        let given = match file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let canonical = given.canonicalize()?;
        let (given, prefix) = (given.to_owned(), String::new());
        Ok(Self { canonical, given, prefix, most: limits::FILE_BYTES })
    }

    /// The folder of the file whose name within the scene's folder is `name`.
    pub(crate) fn beside(&self, name: &str) -> Self {
        let prefix = name.rfind('/').map_or("", |end| &name[..=end]);
        Self { prefix: prefix.to_owned(), ..self.clone() }
    }

    /// The same folder, with files limited to `most` bytes.
    pub(crate) fn limited(&self, most: u64) -> Self {
        Self { most, ..self.clone() }
    }

    /// Reads a file of this folder.
    pub(crate) fn read_file(&self, path: &Path) -> io::Result<Vec<u8>> {
        read_file(path, self.most)
    }

    /// A URI's name within the scene's folder, and its path on disk.
    pub(crate) fn resolve(&self, uri: &str) -> Result<(String, PathBuf), Fault> {
        let outside = || Fault::Outside { uri: shorten(uri) };
        let faulty = |why| Fault::Name { uri: shorten(uri), why };
        let decoded = percent_decode(uri).ok_or_else(|| {
            faulty("which is not UTF-8 once decoded: rename the file, and write its name in UTF-8")
        })?;
        if decoded.contains('\0') {
            return Err(faulty("which holds a NUL character: correct the name in the scene"));
        }
        let name = file_name(&decoded).ok_or_else(outside)?;
        let name = format!("{}{name}", self.prefix);
        let path = self.given.join(&name);
        let missing = |source| Fault::Missing { uri: shorten(uri), source };
        if !path.canonicalize().map_err(missing)?.starts_with(&self.canonical) {
            return Err(outside());
        }
        Ok((name, path))
    }

    /// Reads a file that a URI names.
    pub(crate) fn read(&self, uri: &str) -> Result<(String, PathBuf, Vec<u8>), Fault> {
        let (name, path) = self.resolve(uri)?;
        let bytes =
            self.read_file(&path).map_err(|source| Fault::Missing { uri: shorten(uri), source })?;
        Ok((name, path, bytes))
    }
}

/// The canonical name of a file, given a path within the scene's folder. Its parts are separated by
/// `/`. The path may also have `\` as on Windows, doubled slashes or `.`. `None` where the path
/// leads out of the folder: an absolute path, one with `..`, or one of another machine.
pub fn file_name(path: &str) -> Option<String> {
    let mut parts = path.split(['/', '\\']);
    let first = parts.next()?;
    let leads_elsewhere = first.is_empty() || first.contains(':');
    if leads_elsewhere || path.contains('\0') || path.split(['/', '\\']).any(|part| part == "..") {
        return None;
    }
    let parts: Vec<_> =
        [first].into_iter().chain(parts).filter(|part| !matches!(*part, "" | ".")).collect();
    (!parts.is_empty()).then(|| parts.join("/"))
}

fn percent_decode(uri: &str) -> Option<String> {
    String::from_utf8(percent_decode_bytes(uri.as_bytes())).ok()
}

fn percent_decode_bytes(text: &[u8]) -> Vec<u8> {
    let digit = |at: usize| text.get(at).and_then(|c| char::from(*c).to_digit(16));
    let mut bytes = Vec::with_capacity(text.len());
    let mut at = 0;
    while let Some(&byte) = text.get(at) {
        match (byte, digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((high * 16 + low) as u8);
                at += 3;
            }
            _ => {
                bytes.push(byte);
                at += 1;
            }
        }
    }
    bytes
}

/// Decodes a `data:` URI; `None` when it is another kind of URI.
pub(crate) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, Fault>> {
    let (header, data) = match uri.strip_prefix("data:")?.split_once(',') {
        Some(parts) => parts,
        None => return Some(Err(invalid("a data: URI without a comma"))),
    };
    if !header.ends_with(";base64") {
        return Some(Ok(percent_decode_bytes(data.as_bytes())));
    }
    let config = GeneralPurposeConfig::new()
        .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent);
    let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
    Some(engine.decode(data).map_err(|e| invalid(format!("a data: URI is not base64: {e}"))))
}

/// Shortens a URI for messages, since data URIs are long.
pub(crate) fn shorten(uri: &str) -> String {
    match uri.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &uri[..end]),
        None => uri.to_owned(),
    }
}

/// Shared bytes: a whole file, or a part of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Bytes {
    data: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl From<Vec<u8>> for Bytes {
    fn from(data: Vec<u8>) -> Self {
        Self { range: 0..data.len(), data: Arc::new(data) }
    }
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.data[self.range.clone()]
    }
}

/// A glTF's JSON and, in a .glb, its binary chunk.
#[derive(Debug)]
pub(super) struct Container {
    pub(super) json: Bytes,
    pub(super) binary: Option<Bytes>,
    /// Whether the JSON was padded with NULs, which are removed.
    pub(super) is_padded: bool,
}

const MAGIC: &[u8] = b"glTF";
/// The byte-order mark of UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

impl Container {
    /// Splits a .glb into its chunks, or takes a .gltf as JSON. Their first bytes tell them apart.
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, Fault> {
        if !bytes.starts_with(MAGIC) {
            return Self::of(bytes.into(), None);
        }
        let whole = Bytes::from(bytes);
        let word = |at: usize| whole.get(at..at + 4).and_then(|b| b.try_into().ok());
        let word = |at: usize| word(at).map(u32::from_le_bytes);
        let cut = || invalid("the .glb file is cut off; fetch or export it again");
        let (Some(version), Some(length)) = (word(4), word(8)) else { return Err(cut()) };
        if version != 2 {
            return Err(invalid(format!("a .glb of version {version}; version 2 is read")));
        }
        let length = length as usize;
        if length > whole.len() {
            return Err(cut());
        }
        let (mut json, mut binary, mut at) = (None, None, 12);
        while at + 8 <= length {
            let (Some(size), Some(kind)) = (word(at), word(at + 4)) else { return Err(cut()) };
            let end = at + 8 + size as usize;
            if end > length {
                return Err(cut());
            }
            let chunk = Bytes { data: whole.data.clone(), range: at + 8..end };
            match kind {
                JSON_CHUNK if json.is_none() => json = Some(chunk),
                BINARY_CHUNK if binary.is_none() => binary = Some(chunk),
                _ => {}
            }
            at = end.next_multiple_of(4);
        }
        let json = json.ok_or_else(|| invalid("the .glb file has no JSON chunk"))?;
        Self::of(json, binary)
    }

    /// Removes what some programs put around JSON: a byte-order mark before it, NULs after it.
    fn of(mut json: Bytes, binary: Option<Bytes>) -> Result<Self, Fault> {
        if json.len() as u64 > limits::JSON_BYTES {
            return Err(Fault::TooLarge {
                what: "bytes of JSON".into(),
                limit: limits::JSON_BYTES,
            });
        }
        if json.starts_with(BYTE_ORDER_MARK) {
            json.range.start += BYTE_ORDER_MARK.len();
        }
        let is_blank = |byte: &&u8| **byte == 0 || byte.is_ascii_whitespace();
        let blank = json.iter().rev().take_while(is_blank).count();
        let is_padded = json[json.len() - blank..].contains(&0);
        json.range.end -= blank;
        Ok(Self { json, binary, is_padded })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        for (uri, name) in [
            ("a.png", "a.png"),
            ("./a/./b.png", "a/b.png"),
            ("..a", "..a"),
            ("a//b", "a/b"),
            ("a\\b.png", "a/b.png"),
            (".\\a\\/b", "a/b"),
        ] {
            assert_eq!(file_name(uri).as_deref(), Some(name), "{uri}");
        }
        for uri in [
            "",
            ".",
            "..",
            "../a",
            "a/../../b",
            "/etc/passwd",
            "//host/a",
            "file:a",
            "C:\\a",
            "\\a",
            "\\\\host\\a",
            "..\\a",
            "a\\..\\..\\b",
            "a\0",
        ] {
            assert_eq!(file_name(uri), None, "{uri:?}");
        }
    }

    #[test]
    fn percent_signs() {
        assert_eq!(percent_decode("a%20b%2e%").as_deref(), Some("a b.%"));
        assert_eq!(percent_decode("%ff"), None);
    }

    #[test]
    fn data_uris() {
        let decode = |uri| data_uri(uri).map(|r| r.ok());
        assert_eq!(decode("data:a/b;base64,AAEC"), Some(Some(vec![0, 1, 2])));
        assert_eq!(decode("data:a/b;base64,AAE"), Some(Some(vec![0, 1])));
        assert_eq!(decode("data:,a%20b"), Some(Some(b"a b".to_vec())));
        assert_eq!(decode("data:a/b;base64,*"), Some(None));
        assert_eq!(decode("data:a/b"), Some(None));
        assert_eq!(decode("a.bin"), None);
    }
}
