//! Static analysis of Cosserat rods: the stable equilibrium that a state comes to, several of them, those along what changes,
//! their modes, and the rest shape of a given equilibrium.
//!
//! - [`equilibrium`]: chains, trees and rings by Newton's method with the exact tangent, down in energy (`newton.rs`). Sets with
//!   several loops, large ones in wind, and what Newton's method does not bring to rest: pseudo-transient continuation
//!   (`pseudo_transient.rs`), which takes many more solves. Both leave an unstable equilibrium where rounding or the state's own
//!   imperfection pushes, as a real rod would. `contact.rs`: contacts with obstacles at rest, without friction.
//! - [`mod@branches`]: several equilibria by deflation. [`mod@path`]: arc-length continuation. [`mod@modes`]: modal analysis about an
//!   equilibrium. [`inverse_shape`]: rest shapes.
//!
//! It knows no step in time. It is internal: programs use `cosserat`.

mod balance;
pub mod branches;
mod contact;
mod error;
pub mod inverse_shape;
pub mod modes;
mod newton;
mod params;
pub mod path;
mod pseudo_transient;
mod report;

use component::{Component, Members, split};
use contact::Contacts;
use jointed::linear::solvers::SolverKind;
use rod::{JointForce, Model, State};

pub use error::StaticError;
pub use params::{StaticMethod, StaticParams, StaticParamsError};
pub use report::StaticReport;

/// In wind, sets of more segments than this are left to the flow at once: of trees, one of 206 comes to rest by Newton's method,
/// those of 355, 656 and 1,061 spend its solves in vain.
const MOST_IN_WIND: usize = 300;

/// Brings `state` to equilibrium; velocities are set to zero. Rods that lie in an obstacle come out of it.
///
/// Joints with laws come there in one increment from the internal variables of `state`, infinitely slowly, so that those that relax have done
/// so; the internal variables become those of the equilibrium.
///
/// What is driven stays where it is at time 0. Wind is that of time 0, gusts included; its drag follows the shape from step to
/// step, so that slack rods in a strong wind may not come to rest here: let them settle in time instead.
///
/// # Errors
/// If the model, the state or a parameter is not valid, the model has contacts that are not known
/// ([`StaticError::UnknownContacts`]), forces push what nothing holds ([`StaticError::DrivenOff`]), or a
/// joint would bear more than it can ([`StaticError::Breaks`]). Not to converge is no error: see [`StaticReport::converged`].
pub fn equilibrium(model: &Model, state: &mut State, params: &StaticParams) -> Result<StaticReport, StaticError> {
    model.validate(state)?;
    params.validate()?;
    error::without_eyelets(model, "static analysis")?;
    contact::refuse_unknown(model)?;
    state.velocities.fill(nalgebra::Vector3::zeros());
    state.angular_velocities.fill(nalgebra::Vector3::zeros());
    let mut report = StaticReport { converged: true, stable: Some(true), ..StaticReport::default() };
    report.forces.resize(model.joints.len(), JointForce::default());
    for (members, topology) in split(model) {
        let topology = std::sync::Arc::new(topology);
        let still = || {
            let mut component = Component::new(model, state, topology.clone(), &[&members]);
            component.hold_still();
            component.stop_inner_damping();
            component.change_laws_slowly();
            component
        };
        let mut component = still();
        let mut contacts = Contacts::new(model, &members, &component);
        if contacts.is_empty() {
            refuse_driven_off(&component, &members, is_windy(model))?;
        }
        let is_for_newton = !(contacts.is_empty() && is_windy(model) && members.segments.len() > MOST_IN_WIND);
        let newton = (params.method == StaticMethod::Newton && is_for_newton)
            .then(|| newton::fits(&component, &topology))
            .flatten();
        if newton.is_none() && !contacts.is_empty() {
            return Err(StaticError::UnknownContacts(match params.method {
                StaticMethod::Newton => "only of chains, trees and single rings, without torques and loads that follow",
                _ => "only by method newton",
            }));
        }
        let descend = |memory| newton::descend(&mut component, memory, &mut contacts, params);
        let mut own = newton.map_or_else(StaticReport::default, descend);
        if !own.converged && own.steps < params.max_steps && !contacts.is_empty() {
            // Once more, with round obstacles that grow.
            component = still();
            contacts = Contacts::new(model, &members, &component);
            let memory = contacts.withdraw().then(|| newton::fits(&component, &topology)).flatten();
            if let Some(memory) = memory {
                let left = StaticParams { max_steps: params.max_steps - own.steps, ..*params };
                let again = newton::descend(&mut component, memory, &mut contacts, &left);
                own = StaticReport { steps: own.steps + again.steps, loops: own.loops + again.loops, ..again };
            }
        }
        if own.converged {
            report.contacts.extend(contacts.forces(&members, &component));
        }
        if !own.converged && own.steps < params.max_steps && contacts.is_empty() {
            component = still();
            let mut solver = SolverKind::Direct.build(model, &members, &topology)?;
            let left = StaticParams { max_steps: params.max_steps - own.steps, ..*params };
            let relaxed = pseudo_transient::relax(&mut component, solver.as_mut(), &left);
            own = StaticReport {
                steps: own.steps + relaxed.steps,
                loops: own.loops,
                most_in_loop: own.most_in_loop,
                ..relaxed
            };
        }
        report.converged &= own.converged;
        report.steps += own.steps;
        report.loops += own.loops;
        report.most_in_loop = report.most_in_loop.max(own.most_in_loop);
        report.movement = report.movement.max(own.movement);
        report.stable = report.stable.zip(own.stable).map(|(all, own)| all && own);
        if own.converged {
            component.end_laws();
        }
        component.store_state(state, &members, 0);
        component.store_joint_forces(&mut report.forces, &members, 0);
    }
    if report.converged {
        error::refuse_breaks(model, state, &report.forces)?;
    }
    Ok(report)
}

/// Forces whose sum is less than this share of them are in balance.
const BALANCED: f64 = 1e-9;

/// Refuses a set that nothing holds and that weight, loads or wind drive off: it has no equilibrium.
fn refuse_driven_off(component: &Component<f64>, members: &Members, windy: bool) -> Result<(), StaticError> {
    if component.system.topology.fixed.contains(&true) {
        return Ok(());
    }
    let [sum, size] = component.resultant();
    if windy || sum > BALANCED * size {
        return Err(StaticError::DrivenOff { segment: members.segments[0] });
    }
    Ok(())
}

/// Whether there is a wind at time 0.
fn is_windy(model: &Model) -> bool {
    let somewhere = nalgebra::Vector3::zeros();
    model.air.as_ref().is_some_and(|air| air.wind.velocity(&somewhere, 0.0) != nalgebra::Vector3::zeros())
}
