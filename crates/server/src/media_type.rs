//! What kind of file a name stands for.

/// Whether a file of this name is text, by its ending.
pub(crate) fn is_text(name: &str) -> bool {
    let kind = content_type(name);
    kind.starts_with("text/") || kind == "application/json" || kind == "image/svg+xml"
}

/// The media type of a file by the end of its name.
pub(crate) fn content_type(name: &str) -> &'static str {
    let extension = name.rsplit_once('.').map_or("", |(_, e)| e).to_ascii_lowercase();
    match extension.as_str() {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "txt" => "text/plain; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "wasm" => "application/wasm",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "hdr" => "image/vnd.radiance",
        "exr" => "image/x-exr",
        _ => "application/octet-stream",
    }
}
