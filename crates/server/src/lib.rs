//! The tick: edits, animation, gather, encode, publish.
