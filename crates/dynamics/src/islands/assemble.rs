//! Puts the Delassus operator `W = J P J^T` of the contacts that may press together, P being how the bodies answer impulses.

use std::sync::atomic::AtomicBool;

use component::BodyPose;
use contact::contacts_grain;
use contact::geometry::Contact;
use contact::shape::Shape;
use friction::buckets;
use friction::delassus::{Chunk, Part};
use friction::partition::{self, Leaves, Pushed};
use friction::problem::Problem;
use friction::team::pieces::Pieces;
use jointed::linear::articulated::{self, Blocks, Side};
use jointed::linear::compliance::Compliance;
use jointed::transfer::{Row, Rows};
use kernels::lane::Real;
use kernels::math::Vec3;
use kernels::parallel;

use super::TooManyContacts;
use super::sets::Sets;
use crate::connected_set::{ConnectedSet, Projector, Touch};

/// Contacts of a set whose bodies form chains, above which these are split, and sides in a group then, at most. More of these: the matrix
/// does not fit the processor's caches. Fewer: what goes from group to group takes longer than what it saves.
const LONG: usize = 128;
const BLOCK: usize = 32;

/// Memory to put the operator together.
#[derive(Default)]
pub(crate) struct Assembly {
    /// Components that active contacts push, in the order of leaves of the problem's halves.
    components: Vec<Pushed>,
    /// Nodes of the halves that hold the contacts, their new order, and memory to put them in it.
    leaves: Vec<Leaves>,
    order: Vec<u32>,
    before: Vec<u32>,
    /// Number of each component of the island among `components`, `u32::MAX` where none pushes it.
    number_of: Vec<u32>,
    /// The same of the two sides of each contact.
    pushed: Vec<[u32; 2]>,
    /// Contacts by component, and where those of each begin, and the end.
    by_set: Vec<u32>,
    start: Vec<usize>,
    /// The same by groups, and the first group of each component, and the end.
    members: Vec<u32>,
    groups: Vec<usize>,
    first_groups: Vec<usize>,
    /// Of components that have several groups: places of sides along them, with their contacts, and where those of each group begin, and
    /// the end.
    places: Vec<(u32, u32)>,
    cuts: Vec<usize>,
    /// Memory for which components' parts of the operator are in use.
    taken: Vec<AtomicBool>,
}

/// Components of a contact's two sides. The wall of a sheath is of one.
pub(crate) fn components_of(contact: &Contact, shapes: &[Shape]) -> [Option<u32>; 2] {
    let free = |i: u32| {
        let shape = &shapes[i as usize];
        shape.free.then_some(shape.component)
    };
    [free(contact.key.0), contact.others().find_map(|(other, ..)| free(other))]
}

/// The sides of a contact that lie in `component`, under its index among a group's.
fn sides(contact: &Contact, index: u32, shapes: &[Shape], component: u32) -> impl Iterator<Item = Side> {
    let side = move |(i, arm, sign): (u32, Vec3<f64>, f64)| {
        let shape = &shapes[i as usize];
        let here = shape.free && shape.component == component;
        here.then(|| articulated::side(index, shape.body, arm, &contact.frame, sign))
    };
    let others = contact.others().map(|(other, arm, share)| (other, arm, -share));
    std::iter::once((contact.key.0, contact.arms[0], 1.0)).chain(others).filter_map(side)
}

impl Assembly {
    /// Puts the operator of `(contacts, active)`, all and those that may press, together: P is the answer of whole
    /// components, joints included. Puts `active`, and the problem's unknowns, in the order of the problem's halves.
    ///
    /// # Errors
    /// If it would have more than `max_blocks`.
    pub(crate) fn assemble(
        &mut self,
        (contacts, active): (&[Contact], &mut Vec<u32>),
        shapes: &[Shape],
        components: &mut Sets<'_>,
        problem: &mut Problem,
        max_blocks: usize,
    ) -> Result<(), TooManyContacts> {
        self.group(contacts, active, shapes, components, problem);
        let blocks = |group: &[usize]| (group[1] - group[0]).pow(2);
        if self.groups.windows(2).map(blocks).sum::<usize>() > max_blocks {
            return Err(TooManyContacts);
        }
        let Self { members, groups, first_groups, places, cuts: side_cuts, number_of, taken, .. } = self;
        problem.operator.reset(active.len(), groups, members, first_groups);
        taken.resize_with(taken.len().max(first_groups.len()), AtomicBool::default);
        let (values, cuts) = problem.operator.values();
        let parts = Pieces::new(values, cuts, taken);
        let grain = contacts_grain(active.len()).map(|_| 1);
        parallel::each(components.all(), grain, |seat, set| {
            let (number, ConnectedSet { component, projector, exact, touch: Some(touch), .. }) =
                (number_of[seat], &mut **set)
            else {
                return;
            };
            if number == u32::MAX {
                return;
            }
            let solver = match projector {
                Projector::Solve { solver, .. } => solver.looped(),
                Projector::Predict(_) => None,
            };
            let set = number as usize;
            let own_groups = &groups[first_groups[set]..=first_groups[set + 1]];
            let mut values = parts.take(set..set + 1);
            values.fill(Chunk::zero());
            let Touch { number, response, sides: own, .. } = &mut **touch;
            own.clear();
            let contact = |k: u32| &contacts[active[k as usize] as usize];
            if own_groups.len() > 2
                && let Compliance::Tree(transfers) = response
            {
                let own_cuts = &side_cuts[first_groups[set]..=first_groups[set + 1]];
                for (group, ends) in own_groups.windows(2).zip(own_cuts.windows(2)) {
                    let members = &members[group[0]..group[1]];
                    for &(place, k) in &places[ends[0]..ends[1]] {
                        let index = members.partition_point(|&member| member < k) as u32;
                        let here = sides(contact(k), index, shapes, *number);
                        own.extend(here.filter(|side| transfers.place(side.body) == place));
                    }
                }
                let mut chain = Chain::new(own, own_groups, &mut values);
                transfers.couple_blocks(&component.system, (own, own_cuts), &mut chain);
                return;
            }
            for (index, &k) in members[own_groups[0]..own_groups[1]].iter().enumerate() {
                own.extend(sides(contact(k), index as u32, shapes, *number));
            }
            let (mut part, _) = Part::new(own_groups[1] - own_groups[0], false, &mut values);
            let pair = |s: usize, t: usize| (own[s].contact as usize, own[t].contact as usize);
            match exact.as_mut().filter(|exact| exact.is_taken()) {
                Some(exact) => {
                    exact.couple(&component.system.topology, own, |s, t, block| part.add(pair(s, t), &block, s != t));
                }
                None => response.couple(
                    &component.system,
                    solver,
                    own,
                    #[inline(always)]
                    |s, t, block| part.add(pair(s, t), &block, s != t),
                ),
            }
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
        self.number_of.clear();
        self.number_of.resize(sets.len(), u32::MAX);
        self.components.clear();
        for component in active.iter().flat_map(|&k| pushes(k)) {
            let number = &mut self.number_of[sets.seat(component)];
            if *number == u32::MAX {
                *number = self.components.len() as u32;
                let centre = centre(&sets[component as usize].component.poses);
                self.components.push(Pushed { component, centre, contacts: 0, leaf: 0 });
            }
            self.components[*number as usize].contacts += 1;
        }
        problem.partition.deal(active.len(), &mut self.components);
        for (number, set) in self.components.iter().enumerate() {
            self.number_of[sets.seat(set.component)] = number as u32;
        }
        if problem.partition.depth() > 0 {
            let Self { components, number_of, leaves, order, before, .. } = self;
            let leaf = |component: u32| components[number_of[sets.seat(component)] as usize].leaf;
            leaves.clear();
            leaves.extend(active.iter().map(|&k| {
                let of = pushes(k).map(|component| [leaf(component); 2]);
                of.reduce(partition::join).unwrap_or([0; 2])
            }));
            problem.partition.sort(leaves, order);
            problem.reorder(order);
            before.clone_from(active);
            active.clear();
            active.extend(order.iter().map(|&k| before[k as usize]));
        }
        self.pushed.clear();
        self.pushed.extend(active.iter().map(|&k| {
            let of = components_of(&contacts[k as usize], shapes);
            of.map(|component| component.map_or(u32::MAX, |c| self.number_of[sets.seat(c)]))
        }));
        let items = (0..).zip(&self.pushed).flat_map(|(k, &pushed)| distinct(pushed).map(move |g| (g as usize, k)));
        buckets::sort(items, self.components.len(), &mut self.start, &mut self.by_set);
        self.split(|k| &contacts[active[k as usize] as usize], shapes, sets);
    }

    /// Splits the contacts of sets that have many, and whose bodies form chains, into groups by neighbouring sides along these.
    fn split<'a>(&mut self, contact: impl Fn(u32) -> &'a Contact, shapes: &[Shape], sets: &Sets<'_>) {
        let Self { components, by_set, start, members, places, cuts, groups, first_groups, .. } = self;
        members.clear();
        places.clear();
        cuts.clear();
        groups.clear();
        first_groups.clear();
        for (ends, &Pushed { component, .. }) in start.windows(2).zip(&*components) {
            first_groups.push(groups.len());
            let own = &by_set[ends[0]..ends[1]];
            let set = &sets[component as usize];
            // A contact with a sheath's wall has two sides on the outer rod, which belong into one group.
            let is_long = own.len() > LONG
                && !set.exact.as_ref().is_some_and(|exact| exact.is_taken())
                && !own.iter().any(|&k| contact(k).is_of_sheath());
            let touch = if is_long { set.touch.as_deref() } else { None };
            let transfers = match touch.map(|touch| &touch.response) {
                Some(Compliance::Tree(transfers)) if transfers.are_chains() => transfers,
                _ => {
                    groups.push(members.len());
                    cuts.push(places.len());
                    members.extend_from_slice(own);
                    continue;
                }
            };
            let first = places.len();
            let place = |side: Side| (transfers.place(side.body), side.contact);
            places.extend(own.iter().flat_map(|&k| sides(contact(k), k, shapes, component)).map(place));
            places[first..].sort_unstable();
            let size = places.len() - first;
            let blocks = size.div_ceil(BLOCK);
            for block in 0..blocks {
                let [from, to] = [block, block + 1].map(|block| first + size * block / blocks);
                groups.push(members.len());
                cuts.push(from);
                extend_distinct(members, places[from..to].iter().map(|&(_, k)| k));
            }
        }
        first_groups.push(groups.len());
        groups.push(members.len());
        cuts.push(places.len());
    }
}

/// Adds the distinct ones of some numbers, ascending.
fn extend_distinct(members: &mut Vec<u32>, numbers: impl Iterator<Item = u32>) {
    let first = members.len();
    members.extend(numbers);
    members[first..].sort_unstable();
    let mut end = first;
    for k in first..members.len() {
        if end == first || members[end - 1] != members[k] {
            members[end] = members[k];
            end += 1;
        }
    }
    members.truncate(end);
}

/// Puts the parts of the operator of a chain together, group by group.
struct Chain<'a> {
    sides: &'a [Side],
    /// Where the contacts of the group under way begin and end, and those after it.
    groups: &'a [usize],
    part: Part<'a>,
    /// Memory of the groups after it.
    rest: &'a mut [Chunk],
}

impl<'a> Chain<'a> {
    /// Of `sides` in blocks, whose contacts are a group each, in memory that is zero.
    fn new(sides: &'a [Side], groups: &'a [usize], values: &'a mut [Chunk]) -> Self {
        let (part, rest) = Part::new(groups[1] - groups[0], true, values);
        Self { sides, groups, part, rest }
    }
}

impl Blocks for Chain<'_> {
    #[inline(always)]
    fn pair(&mut self, [one, other]: [usize; 2], work: [[f64; 3]; 3]) {
        let [row, column] = [one, other].map(|side| self.sides[side].contact as usize);
        self.part.add((row, column), &work, one != other);
    }

    fn side(&mut self, side: usize, to_last: [Row; 3], from_before: [Row; 3]) {
        self.part.links().add_side(self.sides[side].contact as usize, to_last, from_before);
    }

    fn end(&mut self, passage: &Rows) {
        self.part.links().set_passage(&passage.0);
        self.groups = &self.groups[1..];
        if let [from, to, ..] = *self.groups {
            (self.part, self.rest) = Part::new(to - from, true, std::mem::take(&mut self.rest));
        }
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
