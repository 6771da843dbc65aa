//! Puts the Delassus operator `W = J P J^T` of the contacts that may press together, P being how the bodies answer impulses.

use super::TooManyContacts;
use super::geometry::{Contact, Shape};
use super::problem::Problem;
use super::sets::Sets;
use crate::connected_set::ConnectedSet;
use crate::linear::transfers::{self, Side};

/// Memory to put the operator together.
#[derive(Default)]
pub(crate) struct Coupling {
    /// Components that active contacts push, ascending.
    components: Vec<u32>,
    /// Group of each component of the island, `u32::MAX` where none pushes it.
    group_of: Vec<u32>,
    groups: Vec<[u32; 2]>,
    start: Vec<usize>,
    members: Vec<u32>,
    sides: Vec<Side>,
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
    /// components, joints included.
    ///
    /// # Errors
    /// If it would have more than `most_blocks`.
    pub(crate) fn assemble(
        &mut self,
        (contacts, active): (&[Contact], &[u32]),
        shapes: &[Shape],
        components: &mut Sets<'_>,
        problem: &mut Problem,
        most_blocks: usize,
    ) -> Result<(), TooManyContacts> {
        self.group(contacts, active, shapes, components);
        let blocks = |group: &[usize]| (group[1] - group[0]).pow(2);
        if self.start.windows(2).map(blocks).sum::<usize>() > most_blocks {
            return Err(TooManyContacts);
        }
        let Self { components: pushed, start, members, sides: own, .. } = self;
        problem.operator.reset(active.len(), start, members);
        for (group, &component) in pushed.iter().enumerate() {
            own.clear();
            for (index, &k) in members[start[group]..start[group + 1]].iter().enumerate() {
                own.extend(sides(&contacts[active[k as usize] as usize], index as u32, shapes, component));
            }
            let ConnectedSet { component, touch, .. } = &mut components[component as usize];
            let Some(touch) = touch else { continue };
            let operator = &mut problem.operator;
            touch.response.couple(
                &component.system,
                own,
                #[inline(always)]
                |s, t, block| {
                    let indices = (own[s].contact as usize, own[t].contact as usize);
                    operator.add(group, indices, &block, s != t);
                },
            );
        }
        problem.close();
        Ok(())
    }

    /// Sorts the contacts by the components they push.
    fn group(&mut self, contacts: &[Contact], active: &[u32], shapes: &[Shape], sets: &Sets<'_>) {
        self.group_of.clear();
        self.group_of.resize(sets.len(), u32::MAX);
        self.components.clear();
        for &k in active {
            for component in components_of(&contacts[k as usize], shapes).into_iter().flatten() {
                if self.group_of[sets.seat(component)] == u32::MAX {
                    self.group_of[sets.seat(component)] = 0;
                    self.components.push(component);
                }
            }
        }
        self.components.sort_unstable();
        for (group, &component) in self.components.iter().enumerate() {
            self.group_of[sets.seat(component)] = group as u32;
        }
        self.groups.clear();
        self.start.clear();
        self.start.resize(self.components.len() + 1, 0);
        for &k in active {
            let of = components_of(&contacts[k as usize], shapes);
            let groups = of.map(|component| component.map_or(u32::MAX, |c| self.group_of[sets.seat(c)]));
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

#[cfg(test)]
mod tests;
