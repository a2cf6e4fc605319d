//! Minimum cut of a graph between a source and a sink, by maximum flow (Boykov and Kolmogorov, PAMI 2004).

use std::collections::VecDeque;

/// No parent: the node is free, or is waiting for a new parent.
const NO_PARENT: u32 = u32::MAX;
/// The parent is the source or the sink.
const TERMINAL_PARENT: u32 = u32::MAX - 1;

/// The arcs between nodes, one in each direction for every pair.
#[derive(Clone, Debug)]
pub struct Arcs {
    /// First arc of each node, and a final entry past the last arc.
    first: Vec<u32>,
    /// Node at the end of each arc.
    heads: Vec<u32>,
    /// The arc in the opposite direction.
    backs: Vec<u32>,
    /// Pair of each arc.
    pairs: Vec<u32>,
}

impl Arcs {
    /// Builds the arcs for pairs of distinct nodes below `nodes`.
    pub fn new(nodes: usize, pairs: impl ExactSizeIterator<Item = [u32; 2]> + Clone) -> Self {
        let mut first = vec![0_u32; nodes + 1];
        pairs.clone().flatten().for_each(|node| first[node as usize + 1] += 1);
        for node in 0..nodes {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let none = vec![0; 2 * pairs.len()];
        let mut arcs = Self { heads: none.clone(), backs: none.clone(), pairs: none, first };
        for (pair, [a, b]) in (0..).zip(pairs) {
            let at = [a, b].map(|node| {
                let at = next[node as usize];
                next[node as usize] += 1;
                at
            });
            for (own, back, head) in [(at[0], at[1], b), (at[1], at[0], a)] {
                arcs.heads[own as usize] = head;
                arcs.backs[own as usize] = back;
                arcs.pairs[own as usize] = pair;
            }
        }
        arcs
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.first.len() - 1
    }

    /// Returns the arcs of a node: the arc's number, the node at its end, and its pair.
    pub fn leaving(&self, node: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        let arcs = self.first[node] as usize..self.first[node + 1] as usize;
        arcs.map(|arc| (arc, self.heads[arc] as usize, self.pairs[arc] as usize))
    }

    /// Returns the number of arcs.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Returns true if there are no arcs.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }
}

/// The tree that a node belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

/// A growing flow.
struct Flow<'a> {
    arcs: &'a Arcs,
    /// Remaining capacity of each arc.
    room: Vec<i32>,
    /// Remaining capacity from the source to a node, or if negative, from the node to the sink.
    surplus: Vec<i64>,
    trees: Vec<Tree>,
    /// Arc of each node to its parent.
    parents: Vec<u32>,
    /// When each node's path to its root was last measured, and its length then.
    stamps: Vec<u32>,
    lengths: Vec<u32>,
    time: u32,
    active: VecDeque<u32>,
    is_active: Vec<bool>,
    orphans: VecDeque<u32>,
}

/// Returns the nodes on the source's side of the minimum cut; of several such cuts, the one with the fewest nodes
/// there.
///
/// `room` has the capacity of each arc, at least 0: the cost of separating its node, on the source's side, from its
/// end. `surplus` has the cost of each node on the sink's side, less its cost on the source's side.
pub fn smallest_cut(arcs: &Arcs, room: Vec<i32>, surplus: Vec<i64>) -> Vec<bool> {
    let nodes = arcs.nodes();
    let mut flow = Flow {
        arcs,
        room,
        trees: surplus.iter().map(|&surplus| tree_of(surplus)).collect(),
        parents: surplus.iter().map(|&surplus| if surplus == 0 { NO_PARENT } else { TERMINAL_PARENT }).collect(),
        stamps: vec![0; nodes],
        lengths: surplus.iter().map(|&surplus| u32::from(surplus != 0)).collect(),
        time: 0,
        active: (0..).zip(&surplus).filter(|(_, surplus)| **surplus != 0).map(|(node, _)| node).collect(),
        is_active: surplus.iter().map(|&surplus| surplus != 0).collect(),
        orphans: VecDeque::new(),
        surplus,
    };
    flow.run();
    flow.trees.into_iter().map(|tree| tree == Tree::Source).collect()
}

fn tree_of(surplus: i64) -> Tree {
    match surplus {
        0 => Tree::Free,
        1.. => Tree::Source,
        _ => Tree::Sink,
    }
}

impl Flow<'_> {
    fn run(&mut self) {
        while let Some(node) = self.active.pop_front() {
            let node = node as usize;
            self.is_active[node] = false;
            // A node may have more than one path to the other tree.
            while let Some(bridge) = self.grow(node) {
                self.time += 1;
                self.augment(bridge);
                while let Some(orphan) = self.orphans.pop_front() {
                    self.adopt(orphan as usize);
                }
            }
        }
    }

    /// Returns the remaining capacity from a node of the source's tree to its child through the child's arc, or in the
    /// sink's tree from the child to its parent.
    fn room_to_child(&self, tree: Tree, arc_of_child: usize) -> i32 {
        self.room[if tree == Tree::Source { self.arcs.backs[arc_of_child] as usize } else { arc_of_child }]
    }

    fn activate(&mut self, node: usize) {
        if !self.is_active[node] {
            self.is_active[node] = true;
            self.active.push_back(node as u32);
        }
    }

    /// Adds the free neighbours of a node to its tree. Returns an arc from the source's tree to the sink's tree if they
    /// meet.
    fn grow(&mut self, node: usize) -> Option<usize> {
        let (tree, arcs) = (self.trees[node], self.arcs);
        if tree == Tree::Free {
            return None;
        }
        for (arc, head, _) in arcs.leaving(node) {
            let back = arcs.backs[arc] as usize;
            if self.room_to_child(tree, back) == 0 {
                continue;
            }
            if self.trees[head] == Tree::Free {
                self.trees[head] = tree;
                self.follow(head, back, node);
                self.activate(head);
            } else if self.trees[head] != tree {
                return Some(if tree == Tree::Source { arc } else { back });
            } else if self.stamps[head] <= self.stamps[node] && self.lengths[head] > self.lengths[node] + 1 {
                self.follow(head, back, node);
            }
        }
        None
    }

    /// Makes a node the child of another.
    fn follow(&mut self, child: usize, arc: usize, parent: usize) {
        self.parents[child] = arc as u32;
        self.stamps[child] = self.stamps[parent];
        self.lengths[child] = self.lengths[parent] + 1;
    }

    /// Sends as much flow as fits along the path through an arc from the source's tree to the sink's tree.
    fn augment(&mut self, bridge: usize) {
        let ends = [
            (Tree::Source, self.arcs.heads[self.arcs.backs[bridge] as usize] as usize),
            (Tree::Sink, self.arcs.heads[bridge] as usize),
        ];
        let mut most = i64::from(self.room[bridge]);
        for (tree, end) in ends {
            let mut node = end;
            while self.parents[node] != TERMINAL_PARENT {
                let arc = self.parents[node] as usize;
                most = most.min(i64::from(self.room_to_child(tree, arc)));
                node = self.arcs.heads[arc] as usize;
            }
            most = most.min(self.surplus[node].abs());
        }
        self.send(bridge, most);
        for (tree, end) in ends {
            let mut node = end;
            while self.parents[node] != TERMINAL_PARENT {
                let arc = self.parents[node] as usize;
                self.send(if tree == Tree::Source { self.arcs.backs[arc] as usize } else { arc }, most);
                let parent = self.arcs.heads[arc] as usize;
                if self.room_to_child(tree, arc) == 0 {
                    self.detach(node);
                }
                node = parent;
            }
            self.surplus[node] -= if tree == Tree::Source { most } else { -most };
            if self.surplus[node] == 0 {
                self.detach(node);
            }
        }
    }

    /// Sends an amount through an arc, at most its remaining capacity.
    fn send(&mut self, arc: usize, amount: i64) {
        let back = self.arcs.backs[arc] as usize;
        self.room[arc] -= amount as i32;
        self.room[back] += amount as i32;
    }

    /// Detaches a node from its parent.
    fn detach(&mut self, node: usize) {
        self.parents[node] = NO_PARENT;
        self.orphans.push_back(node as u32);
    }

    /// Finds another parent with the shortest path to the root for a node, or frees the node.
    fn adopt(&mut self, node: usize) {
        let (tree, arcs) = (self.trees[node], self.arcs);
        let mut best: Option<(u32, usize)> = None;
        for (arc, head, _) in arcs.leaving(node) {
            if self.trees[head] == tree
                && self.room_to_child(tree, arc) > 0
                && let Some(length) = self.path_length(head)
                && best.is_none_or(|(shortest, _)| length < shortest)
            {
                best = Some((length, arc));
            }
        }
        if let Some((length, arc)) = best {
            self.parents[node] = arc as u32;
            self.stamps[node] = self.time;
            self.lengths[node] = length + 1;
            return;
        }
        self.trees[node] = Tree::Free;
        for (arc, head, _) in arcs.leaving(node) {
            if self.trees[head] != tree {
                continue;
            }
            if self.room_to_child(tree, arc) > 0 {
                self.activate(head);
            }
            if self.parents[head] == arcs.backs[arc] {
                self.detach(head);
            }
        }
    }

    /// Returns the length of a node's path to the root of its tree, or `None` if it ends at a node without a parent.
    fn path_length(&mut self, from: usize) -> Option<u32> {
        let (mut node, mut length) = (from, 0);
        let length = loop {
            if self.stamps[node] == self.time {
                break length + self.lengths[node];
            }
            length += 1;
            match self.parents[node] {
                NO_PARENT => return None,
                TERMINAL_PARENT => {
                    self.stamps[node] = self.time;
                    self.lengths[node] = 1;
                    break length;
                }
                arc => node = self.arcs.heads[arc as usize] as usize,
            }
        };
        let (mut node, mut left) = (from, length);
        while self.stamps[node] != self.time {
            self.stamps[node] = self.time;
            self.lengths[node] = left;
            left -= 1;
            node = self.arcs.heads[self.parents[node] as usize] as usize;
        }
        Some(length)
    }
}
