//! Runs a kernel with the widest vector instructions that the machine has.

/// Runs `kernel`, compiled once for each instruction set and chosen at run time.
///
/// The kernel and all it calls must be `#[inline(always)]`, or it runs with the baseline's instructions. The result's
/// bits do not depend on the choice: see [`super::lane`].
#[inline(always)]
pub fn vectorized<R>(kernel: impl FnOnce() -> R) -> R {
    struct Kernel<F>(F);
    impl<R, F: FnOnce() -> R> pulp::NullaryFnOnce for Kernel<F> {
        type Output = R;
        #[inline(always)]
        fn call(self) -> R {
            (self.0)()
        }
    }
    pulp::Arch::new().dispatch(Kernel(kernel))
}
