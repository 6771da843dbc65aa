//! Puts the Delassus operator `W = J P J^T` of the contacts that may press together, P being how the bodies answer impulses.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::TooManyContacts;
use super::buckets;
use super::geometry::{Contact, Shape};
use super::halves::{self, Leaves, Pushed};
use super::operator::Part;
use super::problem::Problem;
use super::sets::Sets;
use crate::component::BodyPose;
use crate::connected_set::{ConnectedSet, Touch};
use crate::kernel::math::Vec3;
use crate::limits::shares_contacts;
use crate::linear::transfers::{self, Side};
use crate::team::pieces::Pieces;

/// Memory to put the operator together.
#[derive(Default)]
pub(crate) struct Coupling {
    /// Components that active contacts push, a group each, in the order of leaves of the problem's halves.
    components: Vec<Pushed>,
    /// Nodes of the halves that hold the contacts, their new order, and memory to put them in it.
    leaves: Vec<Leaves>,
    order: Vec<u32>,
    before: Vec<u32>,
    /// Group of each component of the island, `u32::MAX` where none pushes it.
    group_of: Vec<u32>,
    groups: Vec<[u32; 2]>,
    start: Vec<usize>,
    members: Vec<u32>,
    /// Memory for which groups' parts of the operator are in use.
    taken: Vec<AtomicBool>,
}

/// Components of a contact's two sides.
pub(crate) fn components_of(contact: &Contact, shapes: &[Shape]) -> [Option<u32>; 2] {
    let free = |i: u32| {
        let shape = &shapes[i as usize];
        shape.free.then_some(shape.component)
    };
    [free(contact.key.0), contact.key.1.segment().and_then(free)]
}

/// The sides of a contact that lie in `component`, under its index among a group's.
fn sides(contact: &Contact, index: u32, shapes: &[Shape], component: u32) -> impl Iterator<Item = Side> {
    let side = |i: u32, k: usize, sign: f64| {
        let shape = &shapes[i as usize];
        let here = shape.free && shape.component == component;
        here.then(|| transfers::side(index, shape.body, contact.arms[k], &contact.frame, sign))
    };
    [side(contact.key.0, 0, 1.0), contact.key.1.segment().and_then(|i| side(i, 1, -1.0))].into_iter().flatten()
}

impl Coupling {
    /// Puts the operator of `(contacts, active)`, all and those that may press, together: P is the answer of whole
    /// components, joints included. Puts `active`, and the problem's unknowns, in the order of the problem's halves.
    ///
    /// # Errors
    /// If it would have more than `most_blocks`.
    pub(crate) fn assemble(
        &mut self,
        (contacts, active): (&[Contact], &mut Vec<u32>),
        shapes: &[Shape],
        components: &mut Sets<'_>,
        problem: &mut Problem,
        most_blocks: usize,
    ) -> Result<(), TooManyContacts> {
        self.group(contacts, active, shapes, components, problem);
        let blocks = |group: &[usize]| (group[1] - group[0]).pow(2);
        if self.start.windows(2).map(blocks).sum::<usize>() > most_blocks {
            return Err(TooManyContacts);
        }
        let Self { start, members, group_of, taken, .. } = self;
        problem.operator.reset(active.len(), start, members);
        taken.resize_with(taken.len().max(start.len()), AtomicBool::default);
        let (values, cuts) = problem.operator.values();
        let parts = Pieces::new(values, cuts, taken);
        let is_shared = shares_contacts(active.len());
        each(components.all(), is_shared, |seat, set| {
            let (group, ConnectedSet { component, touch: Some(touch), .. }) = (group_of[seat], set) else { return };
            if group == u32::MAX {
                return;
            }
            let group = group as usize;
            let Touch { number, response, sides: own, .. } = &mut **touch;
            own.clear();
            let members = &members[start[group]..start[group + 1]];
            for (index, &k) in members.iter().enumerate() {
                own.extend(sides(&contacts[active[k as usize] as usize], index as u32, shapes, *number));
            }
            let mut values = parts.take(group..group + 1);
            let mut part = Part::new(members.len(), &mut values);
            response.couple(
                &component.system,
                own,
                #[inline(always)]
                |s, t, block| part.add((own[s].contact as usize, own[t].contact as usize), &block, s != t),
            );
        });
        problem.close();
        Ok(())
    }

    /// Sorts the contacts by the components they push.
    fn group(
        &mut self,
        contacts: &[Contact],
        active: &mut Vec<u32>,
        shapes: &[Shape],
        sets: &Sets<'_>,
        problem: &mut Problem,
    ) {
        let pushes = |k: u32| components_of(&contacts[k as usize], shapes).into_iter().flatten();
        self.group_of.clear();
        self.group_of.resize(sets.len(), u32::MAX);
        self.components.clear();
        for component in active.iter().flat_map(|&k| pushes(k)) {
            let group = &mut self.group_of[sets.seat(component)];
            if *group == u32::MAX {
                *group = self.components.len() as u32;
                let centre = centre(&sets[component as usize].component.poses);
                self.components.push(Pushed { component, centre, contacts: 0, leaf: 0 });
            }
            self.components[*group as usize].contacts += 1;
        }
        problem.halves.deal(active.len(), &mut self.components);
        for (group, set) in self.components.iter().enumerate() {
            self.group_of[sets.seat(set.component)] = group as u32;
        }
        if problem.halves.depth() > 0 {
            let Self { components, group_of, leaves, order, before, .. } = self;
            let leaf = |component: u32| components[group_of[sets.seat(component)] as usize].leaf;
            leaves.clear();
            leaves.extend(active.iter().map(|&k| {
                let of = pushes(k).map(|component| [leaf(component); 2]);
                of.reduce(halves::join).unwrap_or([0; 2])
            }));
            problem.halves.sort(leaves, order);
            problem.reorder(order);
            before.clone_from(active);
            active.clear();
            active.extend(order.iter().map(|&k| before[k as usize]));
        }
        self.groups.clear();
        self.groups.extend(active.iter().map(|&k| {
            let of = components_of(&contacts[k as usize], shapes);
            of.map(|component| component.map_or(u32::MAX, |c| self.group_of[sets.seat(c)]))
        }));
        let items = (0..).zip(&self.groups).flat_map(|(k, &groups)| distinct(groups).map(move |g| (g as usize, k)));
        buckets::sort(items, self.components.len(), &mut self.start, &mut self.members);
    }
}

/// Works on all sets with their seats, side by side if that is worth it.
fn each(sets: &mut [Box<ConnectedSet>], is_shared: bool, work: impl Fn(usize, &mut ConnectedSet) + Sync) {
    if is_shared {
        sets.par_iter_mut().enumerate().for_each(|(seat, set)| work(seat, set));
    } else {
        sets.iter_mut().enumerate().for_each(|(seat, set)| work(seat, set));
    }
}

/// The centre of bodies [m].
fn centre(poses: &[BodyPose<f64>]) -> Vec3<f64> {
    let sum = poses.iter().fold(Vec3::zero(), |sum, pose| sum + pose.x);
    sum * (1.0 / poses.len() as f64)
}

fn distinct([a, b]: [u32; 2]) -> impl Iterator<Item = u32> + Clone {
    [a, if a == b { u32::MAX } else { b }].into_iter().filter(|&group| group != u32::MAX)
}

#[cfg(test)]
mod tests;
