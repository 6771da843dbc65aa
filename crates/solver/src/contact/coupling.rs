//! The Delassus operator `W = J P J^T` of the contacts that may press, P being how the bodies answer impulses.

use super::TooManyContacts;
use super::geometry::{Contact, Shape};
use super::problem::{Pattern, Problem};
use crate::connected_set::ConnectedSet;
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::kernel::math::Vec3;
use crate::linear::response::{COLUMNS, Columns, Response};

/// A contact's side: its component, body, arm and sign.
#[derive(Clone, Copy)]
struct Side {
    body: u32,
    arm: Vec3<f64>,
    sign: f64,
}

/// Memory to put the operator together.
#[derive(Default)]
pub(crate) struct Coupling {
    /// Components that active contacts push, ascending.
    components: Vec<u32>,
    /// Group of each component, `u32::MAX` where none pushes it.
    group_of: Vec<u32>,
    groups: Vec<[u32; 2]>,
    start: Vec<usize>,
    members: Vec<u32>,
    impulses: Vec<Spatial<Columns>>,
}

/// Components of a contact's two sides.
pub(crate) fn components_of(contact: &Contact, shapes: &[Shape]) -> [Option<u32>; 2] {
    let free = |i: u32| {
        let shape = &shapes[i as usize];
        shape.free.then_some(shape.component)
    };
    [free(contact.key.0), contact.key.1.segment().and_then(free)]
}

/// The sides of a contact that lie in `component`.
fn sides(contact: &Contact, shapes: &[Shape], component: u32) -> [Option<Side>; 2] {
    let side = |i: u32, k: usize, sign: f64| {
        let shape = &shapes[i as usize];
        let here = shape.free && shape.component == component;
        here.then_some(Side { body: shape.body, arm: contact.arms[k], sign })
    };
    [side(contact.key.0, 0, 1.0), contact.key.1.segment().and_then(|i| side(i, 1, -1.0))]
}

impl Coupling {
    /// Puts the operator of `(contacts, active)`, all and those that may press, together: P is the answer of whole
    /// components, joints included.
    ///
    /// # Errors
    /// If it would have more than `most_blocks`.
    pub(crate) fn assemble(
        &mut self,
        (contacts, active): (&[Contact], &[u32]),
        shapes: &[Shape],
        components: &[ConnectedSet],
        responses: &mut [Response],
        problem: &mut Problem,
        most_blocks: usize,
    ) -> Result<(), TooManyContacts> {
        self.group(contacts, active, shapes, components.len());
        let blocks = |group: &[usize]| (group[1] - group[0]).pow(2);
        if self.start.windows(2).map(blocks).sum::<usize>() > most_blocks {
            return Err(TooManyContacts);
        }
        let Self { components: pushed, start, members, impulses, groups, .. } = self;
        problem.reset(&Pattern { start, members }, groups);
        for (group, &component) in pushed.iter().enumerate() {
            let response = &mut responses[component as usize];
            let system = &components[component as usize].component.system;
            response.prepare(system);
            let own = &members[start[group]..start[group + 1]];
            for batch in 0..(3 * own.len()).div_ceil(COLUMNS) {
                let columns = batch * COLUMNS..((batch + 1) * COLUMNS).min(3 * own.len());
                impulses.clear();
                impulses.resize(system.bodies.len(), Spatial::zero());
                for (lane, column) in columns.clone().enumerate() {
                    let contact = &contacts[active[own[column / 3] as usize] as usize];
                    for side in sides(contact, shapes, component).into_iter().flatten() {
                        add(&mut impulses[side.body as usize], lane, contact.frame[column % 3] * side.sign, side.arm);
                    }
                }
                response.respond(impulses);
                for &row in own {
                    let contact = &contacts[active[row as usize] as usize];
                    let moved = moves(contact, shapes, component, impulses);
                    let mut place = 0;
                    for (lane, column) in columns.clone().enumerate() {
                        if lane == 0 || column % 3 == 0 {
                            place = problem.place(row, own[column / 3]);
                        }
                        problem.add(row, place, column % 3, moved.map(|x| x.lane(lane)));
                    }
                }
            }
        }
        problem.close();
        Ok(())
    }

    /// Sorts the contacts by the components they push.
    fn group(&mut self, contacts: &[Contact], active: &[u32], shapes: &[Shape], count: usize) {
        self.group_of.clear();
        self.group_of.resize(count, u32::MAX);
        self.components.clear();
        for &k in active {
            for component in components_of(&contacts[k as usize], shapes).into_iter().flatten() {
                if self.group_of[component as usize] == u32::MAX {
                    self.group_of[component as usize] = 0;
                    self.components.push(component);
                }
            }
        }
        self.components.sort_unstable();
        for (group, &component) in self.components.iter().enumerate() {
            self.group_of[component as usize] = group as u32;
        }
        self.groups.clear();
        self.start.clear();
        self.start.resize(self.components.len() + 1, 0);
        for &k in active {
            let of = components_of(&contacts[k as usize], shapes);
            let groups = of.map(|component| component.map_or(u32::MAX, |c| self.group_of[c as usize]));
            for group in distinct(groups) {
                self.start[group as usize + 1] += 1;
            }
            self.groups.push(groups);
        }
        for group in 0..self.components.len() {
            self.start[group + 1] += self.start[group];
        }
        self.members.clear();
        self.members.resize(self.start[self.components.len()], 0);
        // Filled from the front; afterwards each start has moved to the next one's.
        for (k, &groups) in self.groups.iter().enumerate() {
            for group in distinct(groups) {
                let at = &mut self.start[group as usize];
                self.members[*at] = k as u32;
                *at += 1;
            }
        }
        self.start.rotate_right(1);
        self.start[0] = 0;
    }
}

fn distinct([a, b]: [u32; 2]) -> impl Iterator<Item = u32> {
    [a, if a == b { u32::MAX } else { b }].into_iter().filter(|&group| group != u32::MAX)
}

/// Adds the impulse `f` at `arm` to one lane.
fn add(impulse: &mut Spatial<Columns>, lane: usize, f: Vec3<f64>, arm: Vec3<f64>) {
    let torque = arm.cross(f);
    for k in 0..3 {
        let (a, b) = (&mut impulse.linear.0[k], &mut impulse.angular.0[k]);
        a.set_lane(lane, a.lane(lane) + f.0[k]);
        b.set_lane(lane, b.lane(lane) + torque.0[k]);
    }
}

/// What corrections of a component's bodies do to a contact, in its frame.
fn moves(contact: &Contact, shapes: &[Shape], component: u32, dp: &[Spatial<Columns>]) -> [Columns; 3] {
    let mut out = [Columns::zero(); 3];
    for side in sides(contact, shapes, component).into_iter().flatten() {
        let Spatial { linear, angular } = dp[side.body as usize];
        let arm = Vec3(side.arm.0.map(Columns::splat));
        let moved = linear + angular.cross(arm);
        for (out, axis) in out.iter_mut().zip(&contact.frame) {
            let axis = Vec3(axis.0.map(|x| Columns::splat(x * side.sign)));
            *out += axis.dot(moved);
        }
    }
    out
}

#[cfg(test)]
mod tests;
