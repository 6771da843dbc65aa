//! Rounds of sweeps over a contacts' problem, by its halves (`partition.rs`) side by side, with a team of threads where there is
//! more than one half.

use std::sync::RwLock;
use std::sync::atomic::AtomicBool;

use kernels::dispatch::vectorized;
use kernels::parallel;

use super::anderson::{Anderson, Share};
use super::buckets;
use super::delassus::{Chunk, Row};
use super::partition::{self, Partition};
use super::problem::{Matrix, Problem, Unknown, View};
use super::redundant_pairs::{self, RedundantPair};
use crate::team::pieces::{Pieces, Taken};
use crate::team::{self, Team};

/// Sweeps up to which force moves within redundant pairs. What takes more is held up by more than they are: force would go to and fro between them.
const MOVING: usize = 6;
/// Rounds that do not halve the residual after which [`ENOUGH`] will do.
const STALLED: usize = 6;
/// What is good enough then, in tolerances: the next linearisation sees it, and goes on from there.
const ENOUGH: f64 = 2.5;

/// When rounds end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Change of a sweep, or residual, that is good enough.
    pub(super) tolerance: f64,
    /// Sweeps after which they pause.
    pub(super) pause: usize,
    /// Sweeps, at most.
    pub(super) most: usize,
}

/// Why they ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    /// It is good enough, or there were as many sweeps as there may be.
    Done,
    /// There were as many as were asked for, and the last one changed so much.
    Pause { change: f64 },
}

/// Memory of the rounds, and how far they have come.
#[derive(Default)]
pub(super) struct GaussSeidel {
    sweeps: usize,
    /// The residual that must be halved, and the rounds since it was.
    mark: f64,
    rounds_since: usize,
    /// By nodes of the halves, and where each node's begin.
    pairs: Vec<RedundantPair>,
    pair_cuts: Vec<usize>,
    /// One a node.
    shares: Vec<NodeShare>,
    share_cuts: Vec<usize>,
    taken: [Vec<AtomicBool>; 3],
    anderson: RwLock<Anderson>,
}

/// What a node keeps.
#[derive(Default)]
struct NodeShare {
    /// Redundant pairs whose first contact is its own.
    pairs: Vec<RedundantPair>,
    /// Impulses at the start of a round.
    start: Vec<Row>,
    /// Largest change of the last sweep, then largest residual.
    worst: f64,
    rounds: Share,
}

/// Work on a node: on its own contacts with all its subtree, level by level, or on what is its own alone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u8)]
enum Work {
    Forwards,
    RedundantPair,
    Backwards,
    Residual,
    BeginRound,
    Note,
    Differ,
    Extrapolate,
}

impl Work {
    const ALL: [Self; 8] = [
        Self::Forwards,
        Self::RedundantPair,
        Self::Backwards,
        Self::Residual,
        Self::BeginRound,
        Self::Note,
        Self::Differ,
        Self::Extrapolate,
    ];

    /// As a number for the team, on a level.
    fn on(self, level: u32) -> u8 {
        self as u8 + Self::ALL.len() as u8 * level as u8
    }
}

impl GaussSeidel {
    /// Begins with a problem.
    pub(super) fn begin(&mut self, problem: &Problem) {
        (self.sweeps, self.mark, self.rounds_since) = (0, f64::INFINITY, 0);
        let nodes = problem.partition.nodes();
        self.shares.resize_with(self.shares.len().max(nodes), NodeShare::default);
        self.share_cuts.clear();
        self.share_cuts.extend(0..=nodes);
        for taken in &mut self.taken {
            taken.resize_with(taken.len().max(nodes), AtomicBool::default);
        }
        self.find_redundant_pairs(problem);
    }

    /// Sweeps since it began.
    pub(super) fn sweeps(&self) -> usize {
        self.sweeps
    }

    /// Finds redundant pairs, and sorts them by the node that holds both.
    fn find_redundant_pairs(&mut self, problem: &Problem) {
        let Self { pairs, pair_cuts, shares, .. } = self;
        let partition = &problem.partition;
        let shares = &mut shares[..partition.nodes()];
        parallel::each(shares, Some(1), |node, share| {
            redundant_pairs::find(problem, partition.own(node), &mut share.pairs);
        });
        let node = |pair: &RedundantPair| {
            let [a, b] = pair.pair().map(|contact| partition.leaves_of(contact));
            partition.node(partition::join(a, b))
        };
        let found = shares.iter().flat_map(|share| &share.pairs).map(|pair| (node(pair), *pair));
        buckets::sort(found, partition.nodes(), pair_cuts, pairs);
    }

    /// Does rounds until an end of the goal.
    pub(super) fn go(&mut self, problem: &mut Problem, goal: Goal) -> End {
        let (matrix, partition, unknowns, moved) = problem.split();
        let Self { pairs, pair_cuts, shares, share_cuts, taken, anderson, .. } = self;
        let [of_unknowns, of_moved, of_shares] = taken;
        let nodes = partition.nodes();
        if let Ok(anderson) = anderson.get_mut() {
            anderson.begin();
        }
        let field = Field {
            matrix,
            partition,
            pairs,
            pair_cuts,
            unknowns: Pieces::new(unknowns, partition.contact_cuts(), of_unknowns),
            moved: Pieces::new(moved, partition.moved_cuts(), of_moved),
            shares: Pieces::new(&mut shares[..nodes], share_cuts, of_shares),
            anderson,
        };
        let most = usize::from(partition.on_level(0));
        let helpers = if nodes > 1 { parallel::threads().min(most) - 1 } else { 0 };
        let mut end = End::Done;
        let Self { sweeps, mark, rounds_since, .. } = self;
        team::lead(helpers, &|kind, piece| field.work(kind, piece), &mut |team| {
            end = field.rounds(team, goal, sweeps, (mark, rounds_since));
        });
        end
    }
}

/// A problem while threads work on it.
struct Field<'a> {
    matrix: Matrix<'a>,
    partition: &'a Partition,
    pairs: &'a [RedundantPair],
    pair_cuts: &'a [usize],
    unknowns: Pieces<'a, Unknown>,
    moved: Pieces<'a, Chunk>,
    shares: Pieces<'a, NodeShare>,
    anderson: &'a RwLock<Anderson>,
}

impl Field<'_> {
    fn rounds(
        &self,
        team: &mut Team<'_>,
        goal: Goal,
        sweeps: &mut usize,
        (mark, rounds_since): (&mut f64, &mut usize),
    ) -> End {
        let is_over = |sweeps: usize, change: f64| change <= goal.tolerance || sweeps >= goal.most;
        loop {
            self.upwards(team, Work::Forwards);
            *sweeps += 1;
            if is_over(*sweeps, self.worst()) {
                return End::Done;
            }
            if *sweeps < MOVING {
                self.upwards(team, Work::RedundantPair);
            }
            for level in (0..=self.partition.depth()).rev() {
                team.all(Work::Backwards.on(level), self.partition.on_level(level));
            }
            *sweeps += 1;
            let change = self.worst();
            if is_over(*sweeps, change) {
                return End::Done;
            }
            self.upwards(team, Work::Residual);
            let residual = self.worst();
            if residual < 0.5 * *mark {
                (*mark, *rounds_since) = (residual, 0);
            } else {
                *rounds_since += 1;
            }
            let enough = if *rounds_since < STALLED { 1.0 } else { ENOUGH };
            if residual <= enough * goal.tolerance {
                return End::Done;
            }
            if *sweeps >= goal.pause {
                return End::Pause { change };
            }
            self.extrapolate(team);
        }
    }

    /// Works on all nodes level by level, from the leaves to the root.
    fn upwards(&self, team: &mut Team<'_>, work: Work) {
        for level in 0..=self.partition.depth() {
            team.all(work.on(level), self.partition.on_level(level));
        }
    }

    /// The largest of what sweeps have left at the nodes.
    fn worst(&self) -> f64 {
        self.all_shares().iter().map(|share| share.worst).fold(0.0, f64::max)
    }

    fn all_shares(&self) -> Taken<'_, NodeShare> {
        self.shares.take(0..self.partition.nodes())
    }

    /// Takes impulses, gaps and slips to where the next round begins.
    fn extrapolate(&self, team: &mut Team<'_>) {
        let nodes = self.partition.nodes() as u16;
        team.all(Work::Note.on(0), nodes);
        let square = self.all_shares().iter().map(|share| share.rounds.square).sum();
        let differs = self.anderson.write().is_ok_and(|mut anderson| anderson.take_round(square));
        if !differs {
            return;
        }
        team.all(Work::Differ.on(0), nodes);
        let shares = self.all_shares();
        let is_solved = self
            .anderson
            .write()
            .is_ok_and(|mut anderson| anderson.take_difference(shares.iter().map(|share| &share.rounds)));
        drop(shares);
        if is_solved {
            team.all(Work::Extrapolate.on(0), nodes);
            self.upwards(team, Work::BeginRound);
        }
    }

    /// A piece of work: kind and level as [`Work::on`] numbers them, and the node on the level, or among all.
    fn work(&self, kind: u8, piece: usize) {
        let kinds = Work::ALL.len() as u8;
        let (work, level) = (Work::ALL[usize::from(kind % kinds)], u32::from(kind / kinds));
        match work {
            Work::Note | Work::Differ | Work::Extrapolate => self.work_alone(work, piece),
            _ => self.work_below(work, level, piece),
        }
    }

    /// Works on a node's own contacts with what its subtree holds.
    fn work_below(&self, work: Work, level: u32, index: usize) {
        let subtree = self.partition.subtree(level, index);
        let node = subtree.end - 1;
        let (own, pairs) = (self.partition.own(node), self.pair_cuts[node]..self.pair_cuts[node + 1]);
        let mut share = self.shares.take(node..node + 1);
        let share = &mut share[0];
        let (mut unknowns, mut moved) = (self.unknowns.take(subtree.clone()), self.moved.take(subtree));
        let (first, first_chunk) = (unknowns.first, moved.first);
        let mut view = View::new(self.matrix, (&mut unknowns, first), (&mut moved, first_chunk));
        vectorized(
            #[inline(always)]
            || match work {
                Work::Forwards => {
                    share.start.clear();
                    share.start.extend(own.clone().map(|contact| view.unknown(contact).force));
                    share.worst = view.sweep(own, false);
                }
                Work::Backwards => share.worst = view.sweep(own, true),
                Work::RedundantPair => {
                    for pair in &self.pairs[pairs] {
                        pair.transfer(&mut view);
                    }
                }
                Work::Residual => share.worst = view.residual(own),
                _ => share.rounds.begin_round(&mut view, own.start),
            },
        );
    }

    /// Works on what is a node's alone.
    fn work_alone(&self, work: Work, node: usize) {
        let first = self.partition.own(node).start;
        let mut share = self.shares.take(node..node + 1);
        let NodeShare { rounds, start, .. } = &mut share[0];
        let Ok(anderson) = self.anderson.read() else { return };
        vectorized(
            #[inline(always)]
            || match work {
                Work::Note => {
                    let (unknowns, moved) = (self.unknowns.take(node..node + 1), self.moved.take(node..node + 1));
                    rounds.note(self.matrix, (&unknowns, first), start, &moved);
                }
                Work::Differ => rounds.differ(self.matrix, first, &anderson),
                _ => rounds.extrapolate(&anderson, &mut self.moved.take(node..node + 1)),
            },
        );
    }
}

#[cfg(test)]
mod tests;
