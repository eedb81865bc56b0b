//! Surfaces that are there in part, by a mask or blended, are so for every ray alike: those of
//! cameras and probes, scattered ones, and those that reach for light. Every check is also given what
//! a tracer would find that forgot about alpha for one kind of ray, and has to refuse it.

mod cameras;
mod common;
mod shadows;
mod sun;
