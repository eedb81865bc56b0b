//! Light fields, scene state and catalogs as bytes.
