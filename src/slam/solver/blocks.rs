//! A symmetric sparse matrix of 3×3 blocks, eliminated in place.

use super::linear::Block;
use crate::{linalg::Sym3, slam::graph::Slot};

/// No block, no node.
pub(super) const NONE: u16 = u16::MAX;

/// A node's diagonal block, right side, and list of blocks. 44 bytes.
#[derive(Debug, Clone, Copy)]
struct Row {
    diagonal: Sym3,
    /// Right side; once solved, the solution.
    side: [f32; 3],
    /// First block of its list.
    first: u16,
    /// Blocks in its list.
    degree: u16,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Not an unknown: its step is zero.
    Fixed,
    Open,
    Eliminated,
}

/// An off-diagonal block, rows for `ends[0] < ends[1]`. 44 bytes.
#[derive(Debug, Clone, Copy)]
struct Entry {
    value: Block,
    ends: [Slot; 2],
    /// The next block in the list of each end.
    next: [u16; 2],
}

/// K rows with at most L blocks above the diagonal.
#[derive(Debug, Clone)]
pub(super) struct Blocks<const K: usize, const L: usize> {
    rows: [Row; K],
    entries: [Entry; L],
    len: u16,
}

impl<const K: usize, const L: usize> Blocks<K, L> {
    pub(super) const fn new() -> Self {
        Self {
            rows: [Row::FIXED; K],
            entries: [Entry::EMPTY; L],
            len: 0,
        }
    }

    pub(super) const fn len(&self) -> usize {
        self.len as usize
    }

    /// An empty matrix without unknowns.
    pub(super) fn clear(&mut self) {
        self.rows.fill(Row::FIXED);
        self.len = 0;
    }

    /// Makes a node an unknown.
    pub(super) fn open(&mut self, slot: Slot) {
        if let Some(row) = self.rows.get_mut(usize::from(slot)) {
            row.state = State::Open;
        }
    }

    pub(super) fn add_diagonal(&mut self, slot: Slot, part: &Sym3, side: [f32; 3]) {
        if let Some(row) = self.rows.get_mut(usize::from(slot)) {
            row.diagonal = row.diagonal.plus(part);
            row.add(side);
        }
    }

    /// Adds to the block of rows `a` and columns `b`; `None` where there is no room. Blocks of fixed nodes are left out.
    pub(super) fn add(&mut self, a: Slot, b: Slot, part: &Block) -> Option<()> {
        if !self.is_open(a) || !self.is_open(b) || a == b {
            return Some(());
        }
        let at = match self.find(a, b) {
            Some(at) => at,
            None => self.link(a, b)?,
        };
        let entry = self.entries.get_mut(usize::from(at))?;
        let part = if a < b { *part } else { transposed(part) };
        for (row, part) in entry.value.iter_mut().zip(part) {
            for (value, part) in row.iter_mut().zip(part) {
                *value += part;
            }
        }
        Some(())
    }

    /// The unknown with the fewest blocks.
    pub(super) fn sparsest(&self) -> Option<Slot> {
        let open = (0..)
            .zip(&self.rows)
            .filter(|(_, row)| row.state == State::Open);
        open.min_by_key(|(_, row)| row.degree).map(|(slot, _)| slot)
    }

    /// Eliminates an unknown: what it tied to its neighbours now ties these to each other. Gives the work done in
    /// hundreds of instructions; `None` where there is no room.
    ///
    /// A node that nothing determines gets no step.
    pub(super) fn eliminate(&mut self, slot: Slot) -> Option<u32> {
        let row = self.rows.get_mut(usize::from(slot))?;
        row.state = State::Eliminated;
        let Row {
            diagonal,
            side,
            first,
            ..
        } = *row;
        let inverse = diagonal.inverse().unwrap_or_default();
        let known = inverse.times(side);
        let mut spent = 2;
        let mut at = first;
        while let Some((a, to_a, next)) = self.entry(at, slot) {
            self.unlink(at, a);
            let to_a = transposed(&to_a);
            // Rows of Bᵀ D⁻¹, for B the block towards `a`.
            let scaled = to_a.map(|column| inverse.times(column));
            if let Some(row) = self.rows.get_mut(usize::from(a)) {
                row.add(to_a.map(|column| -dot(column, known)));
                row.diagonal = row.diagonal.plus(&product(&scaled, &to_a));
            }
            let mut other = next;
            while let Some((c, to_c, after)) = self.entry(other, slot) {
                let columns = transposed(&to_c);
                let part = scaled.map(|row| columns.map(|column| -dot(row, column)));
                self.add(a, c, &part)?;
                other = after;
                spent += 2;
            }
            at = next;
            spent += 2;
        }
        Some(spent)
    }

    /// Solves for an eliminated unknown whose later ones are known; gives the work done in hundreds of instructions.
    pub(super) fn substitute(&mut self, slot: Slot) -> u32 {
        let Some(&Row {
            diagonal,
            mut side,
            first,
            ..
        }) = self.rows.get(usize::from(slot))
        else {
            return 1;
        };
        let mut spent = 2;
        let mut at = first;
        while let Some((a, to_a, next)) = self.entry(at, slot) {
            if let Some(known) = self.step(a) {
                for (side, row) in side.iter_mut().zip(to_a) {
                    *side -= dot(row, known);
                }
            }
            at = next;
            spent += 1;
        }
        if let Some(row) = self.rows.get_mut(usize::from(slot)) {
            row.side = diagonal.inverse().unwrap_or_default().times(side);
        }
        spent
    }

    /// A node's solution, once all are solved; `None` for a fixed one.
    pub(super) fn step(&self, slot: Slot) -> Option<[f32; 3]> {
        let row = self.rows.get(usize::from(slot))?;
        (row.state == State::Eliminated).then_some(row.side)
    }

    fn is_open(&self, slot: Slot) -> bool {
        let row = self.rows.get(usize::from(slot));
        row.is_some_and(|row| row.state == State::Open)
    }

    /// The other end of a block of `slot`'s list, the block with rows for `slot`, and the next of the list.
    fn entry(&self, at: u16, slot: Slot) -> Option<(Slot, Block, u16)> {
        let Entry {
            value,
            ends: [low, high],
            next: [below, above],
        } = self.used(at)?;
        Some(if *low == slot {
            (*high, *value, *below)
        } else {
            (*low, transposed(value), *above)
        })
    }

    fn used(&self, at: u16) -> Option<&Entry> {
        self.entries.get(usize::from(at)).filter(|_| at < self.len)
    }

    /// The block of two unknowns: looked for in the shorter list.
    fn find(&self, a: Slot, b: Slot) -> Option<u16> {
        let degree = |slot: Slot| self.rows.get(usize::from(slot)).map(|row| row.degree);
        let (short, long) = if degree(b) < degree(a) {
            (b, a)
        } else {
            (a, b)
        };
        let mut at = self.rows.get(usize::from(short))?.first;
        while let Some(entry) = self.used(at) {
            let [low, high] = entry.ends;
            let (other, next) = if low == short {
                (high, entry.next[0])
            } else {
                (low, entry.next[1])
            };
            if other == long {
                return Some(at);
            }
            at = next;
        }
        None
    }

    /// A new block of zeros at the front of both lists.
    fn link(&mut self, a: Slot, b: Slot) -> Option<u16> {
        let at = self.len;
        let ends = if a < b { [a, b] } else { [b, a] };
        let mut next = [NONE; 2];
        for (slot, next) in ends.into_iter().zip(&mut next) {
            *next = self.rows.get(usize::from(slot))?.first;
        }
        *self.entries.get_mut(usize::from(at))? = Entry {
            value: [[0.0; 3]; 3],
            ends,
            next,
        };
        for slot in ends {
            let row = self.rows.get_mut(usize::from(slot))?;
            row.first = at;
            row.degree += 1;
        }
        self.len += 1;
        Some(at)
    }

    /// Takes a block out of the list of one of its ends.
    fn unlink(&mut self, at: u16, slot: Slot) {
        let side = |entry: &Entry| usize::from(entry.ends[0] != slot);
        let Some(after) = self.used(at).map(|entry| entry.next[side(entry) & 1]) else {
            return;
        };
        let Some(row) = self.rows.get_mut(usize::from(slot)) else {
            return;
        };
        row.degree = row.degree.saturating_sub(1);
        if row.first == at {
            row.first = after;
            return;
        }
        let mut before = row.first;
        while let Some(entry) = self.entries.get_mut(usize::from(before)) {
            let next = &mut entry.next[usize::from(entry.ends[0] != slot) & 1];
            if *next == at {
                *next = after;
                return;
            }
            before = *next;
        }
    }
}

impl Row {
    const FIXED: Self = Self {
        diagonal: Sym3::diagonal(0.0, 0.0, 0.0),
        side: [0.0; 3],
        first: NONE,
        degree: 0,
        state: State::Fixed,
    };

    fn add(&mut self, side: [f32; 3]) {
        for (sum, part) in self.side.iter_mut().zip(side) {
            *sum += part;
        }
    }
}

impl Entry {
    const EMPTY: Self = Self {
        value: [[0.0; 3]; 3],
        ends: [NONE; 2],
        next: [NONE; 2],
    };
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn transposed(block: &Block) -> Block {
    [0, 1, 2].map(|k| block.map(|row| row[k]))
}

/// Minus the symmetric product of `rows` and `columns`.
fn product(rows: &Block, columns: &Block) -> Sym3 {
    let at = |i: usize, j: usize| -dot(rows[i], columns[j]);
    Sym3 {
        xx: at(0, 0),
        xy: at(0, 1),
        xt: at(0, 2),
        yy: at(1, 1),
        yt: at(1, 2),
        tt: at(2, 2),
    }
}
