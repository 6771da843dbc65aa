//! The laws, each held against a step.

mod contact;
pub(crate) mod energy;
mod finite;
mod momentum;
mod passing;
mod solved;

use crate::law::Violation;
use crate::step::Step;

use energy::EnergyBalance;

/// Holds a step against all laws. Whether all numbers are finite: nothing else is looked at where they are not.
pub(crate) fn laws(step: &Step<'_>, balance: &mut EnergyBalance, violations: &mut Vec<Violation>) -> bool {
    if !finite::finite(step, violations) {
        return false;
    }
    momentum::linear(step, violations);
    momentum::angular(step, violations);
    contact::forces(step, violations);
    contact::depth(step, violations);
    passing::passing(step, violations);
    solved::residual(step, violations);
    solved::open(step, violations);
    balance.step(step, violations);
    true
}

#[cfg(test)]
mod tests;
