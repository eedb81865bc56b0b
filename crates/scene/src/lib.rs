//! glTF and built-in scenes, animation, and edits as data.
