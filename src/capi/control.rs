//! The floating-point state of the caller, set aside while the library computes.
//!
//! Rust, like C without `FENV_ACCESS`, computes as if the processor rounded to nearest, kept
//! subnormal numbers and raised no traps. Renderers switch all of that. Each C entry point that
//! computes therefore reads the control bits. When they are the default, which is one comparison, it
//! just runs, and sets sticky exception flags as any float code does. Otherwise it runs between
//! "save, set the default" and "restore". Promised is then:
//!
//! - the answers are the same bits as under the default state;
//! - no trap fires;
//! - control bits *and* sticky flags are afterwards as they were before.
//!
//! This covers x86-64 and x86 with SSE2 (MXCSR), AArch64 (FPCR, FPSR), Arm with the hard-float ABI
//! (FPSCR) and RISC-V with the F extension (fcsr). Elsewhere the default state is assumed.
//!
//! The registers are changed by inline assembly, because the intrinsics for it are deprecated, and
//! the work between is a function that is never inlined, so that no float operation moves across.

use crate::simd::SMALL;

#[cfg(all(target_arch = "x86", not(target_feature = "sse2")))]
compile_error!("the x87 rounds in extended precision: compile for x86 with SSE2");

/// Runs `work` under the default floating-point state. Where code shall be small, `work` is there once for both cases.
#[inline(always)]
pub(crate) fn with_default<R>(work: impl FnOnce() -> R) -> R {
    let state = State::read();
    match state.is_default() {
        _ if SMALL => set_aside(state, work),
        true => work(),
        false => rarely(state, work),
    }
}

#[cold]
#[inline(never)]
fn rarely<R>(state: State, work: impl FnOnce() -> R) -> R {
    set_aside(state, work)
}

#[inline(always)]
fn set_aside<R>(state: State, work: impl FnOnce() -> R) -> R {
    #[inline(never)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
    /// Restores also when `work` unwinds.
    struct Restore(State);
    impl Drop for Restore {
        fn drop(&mut self) {
            self.0.write();
        }
    }
    let _restore = (!state.is_default()).then(|| {
        State::DEFAULT.write();
        Restore(state)
    });
    apart(work)
}

#[cfg(any(target_arch = "x86_64", target_arch = "x86"))]
mod state {
    use core::arch::asm;

    /// MXCSR: sticky flags in bits 0 to 5, above them DAZ, the masks, the rounding and FTZ.
    #[derive(Clone, Copy)]
    pub struct State(u32);

    impl State {
        pub const DEFAULT: State = State(0x1F80);

        #[inline(always)]
        pub fn read() -> State {
            let mut bits = 0u32;
            // SAFETY: stores MXCSR to a local variable; SSE is there, or this would not compile.
            unsafe {
                asm!("stmxcsr [{}]", in(reg) &raw mut bits, options(nostack, preserves_flags))
            };
            State(bits)
        }

        #[inline(always)]
        pub fn is_default(self) -> bool {
            self.0 & 0xFFC0 == Self::DEFAULT.0
        }

        pub fn write(self) {
            // SAFETY: loads MXCSR from a local variable; the bits were read from it or are those it
            // has at reset, so none is reserved. Compiled float code runs on one side only.
            unsafe {
                asm!("ldmxcsr [{}]", in(reg) &raw const self.0, options(nostack, preserves_flags));
            }
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod state {
    use core::arch::asm;

    /// FPCR, all zero by default, and the sticky flags in FPSR.
    #[derive(Clone, Copy)]
    pub struct State {
        control: u64,
        flags: u64,
    }

    impl State {
        pub const DEFAULT: State = State { control: 0, flags: 0 };

        #[inline(always)]
        pub fn read() -> State {
            let (control, flags): (u64, u64);
            // SAFETY: reads two registers.
            unsafe {
                asm!("mrs {}, fpcr", "mrs {}, fpsr", out(reg) control, out(reg) flags,
                    options(nostack, preserves_flags));
            }
            State { control, flags }
        }

        #[inline(always)]
        pub fn is_default(self) -> bool {
            self.control == 0
        }

        pub fn write(self) {
            // SAFETY: the values were read from these registers or are zero, which both may be.
            unsafe {
                asm!("msr fpcr, {}", "msr fpsr, {}", in(reg) self.control, in(reg) self.flags,
                    options(nostack, preserves_flags));
            }
        }
    }
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod state {
    use core::arch::asm;

    /// FPSCR: condition codes above, control in bits 8 to 26, sticky flags in 0 to 4 and 7.
    #[derive(Clone, Copy)]
    pub struct State(u32);

    impl State {
        pub const DEFAULT: State = State(0);

        #[inline(always)]
        pub fn read() -> State {
            let bits: u32;
            // SAFETY: reads a register that the hard-float ABI guarantees.
            unsafe { asm!("vmrs {}, fpscr", out(reg) bits, options(nostack, preserves_flags)) };
            State(bits)
        }

        #[inline(always)]
        pub fn is_default(self) -> bool {
            self.0 & 0x07FF_FF00 == 0
        }

        pub fn write(self) {
            // SAFETY: the value was read from this register or is zero, its value at reset.
            unsafe { asm!("vmsr fpscr, {}", in(reg) self.0, options(nostack)) };
        }
    }
}

#[cfg(all(any(target_arch = "riscv32", target_arch = "riscv64"), target_feature = "f"))]
mod state {
    use core::arch::asm;

    /// fcsr: sticky flags in bits 0 to 4, the rounding mode in 5 to 7. There are no traps.
    #[derive(Clone, Copy)]
    pub struct State(usize);

    impl State {
        pub const DEFAULT: State = State(0);

        #[inline(always)]
        pub fn read() -> State {
            let bits: usize;
            // SAFETY: reads a register of the F extension, which this target has.
            unsafe { asm!("csrr {}, fcsr", out(reg) bits, options(nostack)) };
            State(bits)
        }

        #[inline(always)]
        pub fn is_default(self) -> bool {
            self.0 & 0xE0 == 0
        }

        pub fn write(self) {
            // SAFETY: the value was read from this register or is zero, its value at reset.
            unsafe { asm!("csrw fcsr, {}", in(reg) self.0, options(nostack)) };
        }
    }
}

#[cfg(not(any(
    target_arch = "x86_64",
    target_arch = "x86",
    target_arch = "aarch64",
    all(target_arch = "arm", target_abi = "eabihf"),
    all(any(target_arch = "riscv32", target_arch = "riscv64"), target_feature = "f"),
)))]
mod state {
    /// No state is known of here: floats are software, or their unit cannot be switched.
    #[derive(Clone, Copy)]
    pub struct State;

    impl State {
        pub const DEFAULT: State = State;

        pub fn read() -> State {
            State
        }

        pub fn is_default(self) -> bool {
            true
        }

        pub fn write(self) {}
    }
}

use state::State;
