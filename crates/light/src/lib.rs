//! Light fields: spherical harmonics, probe volumes, sampling.
