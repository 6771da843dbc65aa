//! How a contact problem is solved, in numbers.

use thiserror::Error;

/// The parameters of the solver. They say how the impulses are found, not how exact they are: that is the tolerance of
/// [`crate::solve::ContactSolver::solve`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverParams {
    /// Gauss-Seidel sweeps of a complementarity problem, at most. Smaller: problems that sweeps are slow at are left to the
    /// next outer iteration.
    pub max_sweeps: usize,
    /// Sweeps between two tries of Newton's method, at first; twice as many after each try that did not help, or half as many, but no
    /// fewer, where sweeps have halved their change since.
    pub sweeps_before_newton: usize,
    /// The first try comes no earlier than after one sweep for so many unknowns: the larger a problem is, the more sweeps an
    /// iteration of Newton's method costs. Larger: sooner.
    pub unknowns_a_sweep: usize,
    /// Unknowns of Newton's method, at most; its cost grows with their cube, and beyond this sweeps alone are faster.
    pub max_newton_unknowns: usize,
    /// Newton iterations in a row, at most.
    pub max_newton_iterations: usize,
    /// How often the line search halves a Newton step, counting the whole step.
    pub max_newton_halvings: usize,
    /// Least damping of Newton's matrix: compliance added to a contact's own, relative to it. It keeps the matrix regular
    /// where several contacts hold the same bodies at the same place, and steps short where they would leave the friction
    /// cones. It changes no solution.
    pub min_newton_damping: f64,
    /// Damping at the start.
    pub initial_newton_damping: f64,
    /// Damping above which the method gives up until the next try.
    pub max_newton_damping: f64,
    /// What a full Newton step multiplies the damping by.
    pub newton_damping_decrease: f64,
    /// What a step that did not help multiplies the damping by.
    pub newton_damping_increase: f64,
}

/// A contact parameter outside of what is allowed.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("contact parameter {name} = {value}, but it must be {allowed}")]
pub struct ParamsError {
    /// Name of the field.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

impl ParamsError {
    /// An error unless `value` is finite and `ok`.
    ///
    /// # Errors
    /// That one.
    pub fn check(name: &'static str, value: f64, ok: bool, allowed: &'static str) -> Result<(), Self> {
        if ok && value.is_finite() { Ok(()) } else { Err(Self { name, value, allowed }) }
    }
}

impl SolverParams {
    /// Those that a simulation has unless told otherwise.
    pub const DEFAULT: Self = Self {
        max_sweeps: 100,
        sweeps_before_newton: 4,
        unknowns_a_sweep: 8,
        max_newton_unknowns: 200,
        max_newton_iterations: 12,
        max_newton_halvings: 3,
        min_newton_damping: 1e-6,
        initial_newton_damping: 1e-5,
        max_newton_damping: 0.1,
        newton_damping_decrease: 0.1,
        newton_damping_increase: 30.0,
    };

    /// Checks every number.
    ///
    /// # Errors
    /// The first that is not allowed.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let check = ParamsError::check;
        let [least, start, most] = [self.min_newton_damping, self.initial_newton_damping, self.max_newton_damping];
        check("min_newton_damping", least, least > 0.0, "finite and > 0")?;
        let decrease = self.newton_damping_decrease;
        check("newton_damping_decrease", decrease, decrease > 0.0 && decrease < 1.0, "> 0 and < 1")?;
        let increase = self.newton_damping_increase;
        check("newton_damping_increase", increase, increase > 1.0, "finite and > 1")?;
        let counts = [
            ("max_sweeps", self.max_sweeps),
            ("sweeps_before_newton", self.sweeps_before_newton),
            ("unknowns_a_sweep", self.unknowns_a_sweep),
        ];
        for (name, count) in counts {
            check(name, count as f64, count > 0, "1 or more")?;
        }
        check("initial_newton_damping", start, least <= start, "finite and not below min_newton_damping")?;
        check("max_newton_damping", most, start <= most, "finite and not below initial_newton_damping")
    }
}

impl Default for SolverParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_each_mistake_is_named() {
        type Change = (&'static str, fn(&mut SolverParams));
        SolverParams::DEFAULT.validate().unwrap();
        let mistakes: [Change; 4] = [
            ("max_sweeps", |p| p.max_sweeps = 0),
            ("newton_damping_decrease", |p| p.newton_damping_decrease = 1.0),
            ("initial_newton_damping", |p| p.initial_newton_damping = 1e-7),
            ("max_newton_damping", |p| p.max_newton_damping = 1e-6),
        ];
        for (name, change) in mistakes {
            let mut params = SolverParams::DEFAULT;
            change(&mut params);
            assert_eq!(params.validate().unwrap_err().name, name);
        }
        let zero = SolverParams { max_sweeps: 0, ..SolverParams::DEFAULT };
        assert_eq!(
            zero.validate().unwrap_err().to_string(),
            "contact parameter max_sweeps = 0, but it must be 1 or more"
        );
    }
}
