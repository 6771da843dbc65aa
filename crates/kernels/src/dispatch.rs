//! Runtime dispatch: a kernel compiled for several instruction sets, of which the machine's best one runs.
//!
//! A kernel and all that it calls must be `#[inline(always)]`, or it runs with the baseline's instructions. Its bits do not
//! depend on the choice: see [`lane`](crate::lane). Each instruction set costs the code of the kernel once more, so dispatch is for
//! kernels in which it is measured to matter: those over [`Lanes`](crate::lane::Lanes), and few over `f64`.

#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// A kernel as `pulp` takes it.
struct Kernel<F>(F);

impl<R, F: FnOnce() -> R> pulp::NullaryFnOnce for Kernel<F> {
    type Output = R;
    #[inline(always)]
    fn call(self) -> R {
        (self.0)()
    }
}

/// Runs `kernel` with the widest vector instructions of the machine: of x86-64 AVX-512, AVX2, or the baseline.
#[inline(always)]
pub fn vectorized<R>(kernel: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(Kernel(kernel))
}

/// Runs a kernel over lanes with the widest vector instructions of the machine.
///
/// # Panics
/// If the machine has no vector registers that pay for lanes: see [`has_lanes`].
#[inline(always)]
pub(crate) fn in_lanes<R>(kernel: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    match pulp::Arch::new() {
        pulp::Arch::V4(simd) => V4::vectorize(simd, Kernel(kernel)),
        pulp::Arch::V3(simd) => V3::vectorize(simd, Kernel(kernel)),
        _ => no_lanes(),
    }
    #[cfg(not(target_arch = "x86_64"))]
    kernel()
}

/// Whether the machine has vector registers that pay for lanes: of x86-64 AVX2. Elsewhere rods move one by one, with the same
/// bits.
pub fn has_lanes() -> bool {
    !cfg!(target_arch = "x86_64") || !matches!(pulp::Arch::new(), pulp::Arch::Scalar)
}

#[cfg(target_arch = "x86_64")]
#[cold]
#[inline(never)]
fn no_lanes() -> ! {
    panic!("a kernel over lanes was called on a machine without AVX2")
}
