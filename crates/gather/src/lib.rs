//! Gathering of light: receivers in, sums out.
