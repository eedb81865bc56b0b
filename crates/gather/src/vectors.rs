//! Work that is done by vectors.

use crate::accel::Kernel;

/// Runs `work`, compiled for the vector instructions that this processor has: AVX2 or NEON. It has to be
/// a closure that is always inlined and calls only such functions; others keep the target's instructions.
/// Results are the same bit for bit: no operation is fused with another or moved.
pub fn by_vectors(work: impl FnOnce()) {
    Kernel::detect().run(work);
}
