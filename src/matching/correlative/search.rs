//! Branch and bound: a block of poses is looked into only if its bound is above the best score so far.

use super::{
    pyramid::Pyramid,
    rotated::Rotated,
    window::{Candidate, Near, SIDE, Window},
};
use crate::scan::ScanPoint;

/// Most blocks of one heading.
const BLOCKS: usize = (SIDE * SIDE) as usize;

/// Poses `x..x + stride`, `y..y + stride` of one heading, and a bound that none of their scores exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Block {
    bound: u32,
    x: i16,
    y: i16,
}

/// Working memory for scans of at most N beams: 8·N bytes and 1.5 KB for the blocks.
#[derive(Debug, Clone)]
pub struct Correlator<const N: usize> {
    pub(super) rotated: Rotated<N>,
    blocks: heapless::Vec<Block, BLOCKS>,
    /// Sums looked up so far, for measuring.
    pub(super) lookups: u64,
}

impl<const N: usize> Correlator<N> {
    /// Empty working memory.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            rotated: Rotated::new(),
            blocks: heapless::Vec::new(),
            lookups: 0,
        }
    }

    /// Bytes looked up so far, for measuring.
    #[must_use]
    pub fn lookups(&self) -> u64 {
        self.lookups
    }

    /// The window's best cell whose sum is above `least`, and outside of what is `near` to another.
    pub fn search(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        window: &Window,
        least: u32,
        near: Option<Near>,
    ) -> Option<Candidate> {
        let mut best = None;
        let mut bar = least;
        let top = pyramid.top_level();
        let stride = pyramid.stride(top);
        let blocks = window.side >> (2 * top);
        for heading in window.outwards() {
            if !self
                .rotated
                .assign(pyramid, points, window.corner(heading), window.side)
            {
                continue;
            }
            self.blocks.clear();
            for y in 0..blocks {
                let mut x = 0;
                while x < blocks {
                    let bounds = self.rotated.row(pyramid, top, x, y);
                    self.lookups += 4 * self.rotated.len() as u64;
                    for (bound, x) in bounds.into_iter().zip(x..blocks) {
                        if bound > bar {
                            let block = Block {
                                bound,
                                x: x * stride as i16,
                                y: y * stride as i16,
                            };
                            let _ = self.blocks.push(block);
                        }
                    }
                    x += 4;
                }
            }
            // Best bound first; few are ever looked into, so that picking each anew beats sorting.
            while let Some(block) = take_best(&mut self.blocks, bar) {
                self.split(pyramid, top, block, heading, near, &mut bar, &mut best);
            }
        }
        best
    }

    /// Looks into a block level by level; raises `bar` and `best` where a cell is better.
    #[allow(clippy::too_many_arguments)]
    fn split(
        &mut self,
        pyramid: &Pyramid<'_>,
        level: usize,
        block: Block,
        heading: i16,
        near: Option<Near>,
        bar: &mut u32,
        best: &mut Option<Candidate>,
    ) {
        let Some(below) = level.checked_sub(1) else {
            let found = Candidate {
                sum: block.bound,
                x: block.x,
                y: block.y,
                heading,
            };
            if block.bound > *bar && !near.is_some_and(|near| near.holds(&found)) {
                *bar = block.bound;
                *best = Some(found);
            }
            return;
        };
        let stride = pyramid.stride(below) as i16;
        let mut parts = [Block {
            bound: 0,
            x: 0,
            y: 0,
        }; 16];
        for (row, parts) in (0i16..).zip(parts.chunks_exact_mut(4)) {
            let y = block.y + row * stride;
            let sums = self
                .rotated
                .row(pyramid, below, block.x >> (2 * below), y >> (2 * below));
            self.lookups += 4 * self.rotated.len() as u64;
            for ((part, bound), column) in parts.iter_mut().zip(sums).zip(0i16..) {
                *part = Block {
                    bound,
                    x: block.x + column * stride,
                    y,
                };
            }
        }
        while let Some(part) = take_best(&mut parts, *bar) {
            self.split(pyramid, below, part, heading, near, bar, best);
        }
    }
}

impl<const N: usize> Default for Correlator<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The first of the blocks with the highest bound above `bar`; it is not given again.
fn take_best(blocks: &mut [Block], bar: u32) -> Option<Block> {
    let mut best: Option<&mut Block> = None;
    for block in blocks {
        if block.bound > best.as_ref().map_or(bar, |best| best.bound) {
            best = Some(block);
        }
    }
    let best = best?;
    let block = *best;
    best.bound = 0;
    Some(block)
}
