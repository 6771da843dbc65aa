//! How contacts are found and solved, in numbers.

use contact::NarrowPhaseParams;
use friction::{ParamsError, SolverParams};

/// The parameters of contacts. Lengths are in radii: those of the smaller body of a contact, or of the segment itself.
///
/// [`ContactParams::DEFAULT`] serves all shipped scenes. But for `release_speed`, these numbers say how contacts are found
/// and solved, not what is good enough: that is [`crate::step::StepParams::contact_tolerance`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// How contacts are found.
    pub narrow_phase: NarrowPhaseParams,
    /// Contacts whose gap is predicted to stay above this are left out of a solve \[radii\]. Larger: larger problems.
    /// Smaller: more iterations in which a contact turns up late.
    pub active_gap: f64,
    /// Where the rods' own correction moves a segment that may touch further than this \[radii\], the first iteration of a
    /// step moves the rods alone, and contacts are looked at from there. Larger: contacts are solved where the bodies are
    /// not going to be. Smaller: an iteration more.
    pub far_correction: f64,
    /// Outer iterations after which normals and places of contacts go half-way to the new ones, so that nearest places which
    /// jump to and fro come to rest. Larger: steps with jumping places take longer.
    pub settle_after: usize,
    /// By how much other places on axes that are nearly parallel must be nearer before a contact
    /// moves there, relative to the contact tolerance. Larger: fewer iterations, and gaps that are less by so much. Smaller: places
    /// jump along the axes from iteration to iteration, and the torques of the contact's force with them.
    pub place_hysteresis: f64,
    /// How exact the direction of sliding friction is, relative to the slip of the step. Larger: fewer iterations.
    pub slip_direction_tolerance: f64,
    /// Speed at which bodies that overlap at the start, where [`rod::Contacts::allow_overlap`] allows it, are moved apart
    /// \[radii/s\]. Larger: the overlap is gone sooner. Smaller: less energy.
    pub release_speed: f64,
    /// How the impulses of contacts are found.
    pub solver: SolverParams,
    /// Error at which the sweeps end, relative to the contact tolerance. Smaller: more sweeps and fewer outer iterations.
    pub sweep_tolerance: f64,
    /// The same relative to the largest error before the solve, where that is more: the next linearisation leaves as much.
    pub sweep_reduction: f64,
    /// Blocks of 3 x 3 numbers in the contacts' matrix, at most: 72 bytes each. A step with more ends with a status of its
    /// own instead of taking all memory.
    pub max_blocks: usize,
    /// Residual of the rods' own constraints that is always good enough in a model with contacts, relative to the contact
    /// tolerance. Larger: fewer iterations, and joints less exact.
    pub joint_tolerance: f64,
    /// In a formulation with momentum residual, how far a surface may be off when a step ends, relative to the contact tolerance.
    /// Larger: fewer iterations, and forces less exact.
    pub motion_tolerance: f64,
    /// Outer iterations after which a step's error must have been below [`ContactParams::max_error`], else it is halved. Smaller:
    /// sooner, also steps that would find back.
    pub max_error_after: usize,
    /// Error of a step that goes astray \[radii\]: linearised contacts say nothing of bodies that far off. Larger: steps are
    /// halved later. Smaller: also steps that come to their end slowly.
    pub max_error: f64,
}

impl ContactParams {
    /// Those that a simulation has unless told otherwise.
    pub const DEFAULT: Self = Self {
        narrow_phase: NarrowPhaseParams::DEFAULT,
        active_gap: 0.1,
        far_correction: 1.0,
        settle_after: 6,
        place_hysteresis: 0.1,
        slip_direction_tolerance: 0.02,
        release_speed: 5.0,
        solver: SolverParams::DEFAULT,
        sweep_tolerance: 0.1,
        sweep_reduction: 3e-3,
        max_blocks: 8_000_000,
        joint_tolerance: 0.01,
        motion_tolerance: 10.0,
        max_error_after: 4,
        max_error: 0.3,
    };

    /// Checks every number.
    ///
    /// # Errors
    /// The first that is not allowed.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let check = ParamsError::check;
        let positive = [
            ("search_room", self.narrow_phase.search_room),
            ("active_gap", self.active_gap),
            ("far_correction", self.far_correction),
            ("slip_direction_tolerance", self.slip_direction_tolerance),
            ("release_speed", self.release_speed),
            ("joint_tolerance", self.joint_tolerance),
            ("motion_tolerance", self.motion_tolerance),
            ("max_error", self.max_error),
        ];
        for (name, value) in positive {
            check(name, value, value > 0.0, "finite and > 0")?;
        }
        let shares = [
            ("parallel", self.narrow_phase.parallel),
            ("sweep_tolerance", self.sweep_tolerance),
            ("sweep_reduction", self.sweep_reduction),
            ("place_hysteresis", self.place_hysteresis),
        ];
        for (name, value) in shares {
            check(name, value, value > 0.0 && value < 1.0, "> 0 and < 1")?;
        }
        check("max_error_after", self.max_error_after as f64, self.max_error_after > 0, "1 or more")?;
        self.solver.validate()
    }
}

impl Default for ContactParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_each_mistake_is_named() {
        type Change = (&'static str, fn(&mut ContactParams));
        ContactParams::DEFAULT.validate().unwrap();
        let mistakes: [Change; 5] = [
            ("search_room", |p| p.narrow_phase.search_room = 0.0),
            ("active_gap", |p| p.active_gap = f64::NAN),
            ("release_speed", |p| p.release_speed = f64::INFINITY),
            ("parallel", |p| p.narrow_phase.parallel = 1.0),
            ("max_sweeps", |p| p.solver.max_sweeps = 0),
        ];
        for (name, change) in mistakes {
            let mut params = ContactParams::DEFAULT;
            change(&mut params);
            assert_eq!(params.validate().unwrap_err().name, name);
        }
    }
}
