//! Corners: where a law bends without a jump.
//!
//! A law with corners is made of smooth pieces. The piece on which a step begins is held until the step ends, also
//! beyond the corner, so that the equations are smooth inside every step; how much of the piece is left tells whether
//! the step has to be cut short.

use crate::real::{Mask, Real};

/// Corners of all laws together.
pub const CORNERS: usize = 16;
/// The torque limit of the speed controller.
pub(super) const TORQUE_LIMIT: usize = 0;
/// Both knees of the piecewise spring.
pub(super) const KNEES: [usize; 2] = [1, 2];
/// Where the corners of the terms begin.
pub(super) const OF_TERMS: usize = 3;

/// One number per corner.
pub type Pieces<V> = [V; CORNERS];

/// What the laws of a base model ask about their corners.
pub trait Bends<R: Real> {
    /// Whether laws stay on the piece that is held.
    fn are_held(&self) -> bool;
    /// `x` limited to `[-bound, bound]`. `size` is the size of `x` below which relative accuracy is not asked for; in
    /// lanes other than these the corner plays no part.
    fn clamp_in(&mut self, lanes: R::Mask, corner: usize, x: R, bound: R, size: f64) -> R;
    /// How much is left of the pieces that are held, in natural sizes.
    fn margin(&self) -> R::Plain;

    /// The same in all lanes.
    #[inline(always)]
    fn clamp(&mut self, corner: usize, x: R, bound: R, size: f64) -> R {
        self.clamp_in(R::Mask::from_bits(u64::MAX), corner, x, bound, size)
    }
}

/// No corner is held and none is asked about.
pub struct Unheld;

impl<R: Real> Bends<R> for Unheld {
    #[inline(always)]
    fn are_held(&self) -> bool {
        false
    }

    #[inline(always)]
    fn clamp_in(&mut self, _lanes: R::Mask, _corner: usize, x: R, bound: R, _size: f64) -> R {
        x.clamp_abs(bound)
    }

    #[inline(always)]
    fn margin(&self) -> R::Plain {
        R::Plain::splat(f64::INFINITY)
    }
}

/// The corners at one evaluation of the equations.
pub struct Corners<'a, R: Real> {
    /// The pieces that are held; where there are none, every law is on the piece on which it lies.
    held: Option<&'a Pieces<R::Plain>>,
    /// The least that is left of any of them.
    margin: R::Plain,
    /// Where it is asked for: how much is left of every piece that is held, or the pieces where none is.
    found: Option<&'a mut Pieces<R::Plain>>,
}

impl<'a, R: Real> Corners<'a, R> {
    /// Of all corners only the least margin is asked for.
    #[inline(always)]
    pub fn new(held: Option<&'a Pieces<R::Plain>>) -> Self {
        Self { held, margin: R::Plain::splat(f64::INFINITY), found: None }
    }

    /// Every corner notes in `found` what it finds.
    #[inline(always)]
    pub fn noting(held: Option<&'a Pieces<R::Plain>>, found: &'a mut Pieces<R::Plain>) -> Self {
        let unused = if held.is_some() { f64::INFINITY } else { 0.0 };
        *found = [R::Plain::splat(unused); CORNERS];
        Self { found: Some(found), ..Self::new(held) }
    }

    /// The same pieces, for a trial of which nothing is noted.
    #[inline(always)]
    pub fn unnoted(&self) -> Self {
        Self::new(self.held)
    }

    /// The sign of `x`: +1 or -1.
    #[inline(always)]
    pub fn sign(&mut self, corner: usize, x: R, size: f64) -> R {
        let piece = self.side(corner, x.plain());
        self.left(corner, x.plain() * piece, size);
        R::constant(piece)
    }

    /// The smaller of two numbers of a size.
    #[inline(always)]
    pub fn min(&mut self, corner: usize, left: R, right: R, size: f64) -> R {
        let apart = right.plain() - left.plain();
        let piece = self.side(corner, apart);
        self.left(corner, piece * apart, size);
        R::select(R::Plain::zero().lt(piece), left, right)
    }

    /// The piece on one side of zero, held or where `x` is.
    #[inline(always)]
    fn side(&mut self, corner: usize, x: R::Plain) -> R::Plain {
        if let Some(pieces) = self.held {
            return pieces[corner];
        }
        let piece = side(x);
        self.note(corner, piece);
        piece
    }

    /// Takes down how much is left of a piece that is held.
    #[inline(always)]
    fn left(&mut self, corner: usize, left: R::Plain, size: f64) {
        if self.held.is_some() {
            let left = left * R::Plain::splat(1.0 / size);
            self.margin = self.margin.min(left);
            self.note(corner, left);
        }
    }

    #[inline(always)]
    fn note(&mut self, corner: usize, finding: R::Plain) {
        if let Some(found) = &mut self.found {
            found[corner] = finding;
        }
    }
}

impl<R: Real> Bends<R> for Corners<'_, R> {
    #[inline(always)]
    fn are_held(&self) -> bool {
        self.held.is_some()
    }

    #[inline(always)]
    fn clamp_in(&mut self, lanes: R::Mask, corner: usize, x: R, bound: R, size: f64) -> R {
        let zero = R::Plain::zero();
        let (place, end) = (x.plain(), bound.plain());
        let Some(pieces) = self.held else {
            self.note(corner, R::Plain::select(lanes & end.lt(place.abs()), side(place), zero));
            return x.clamp_abs(bound);
        };
        let inside = pieces[corner].abs().le(zero);
        let left = R::Plain::select(inside, end - place.abs(), pieces[corner] * place - end);
        self.left(corner, R::Plain::select(lanes, left, R::Plain::splat(f64::INFINITY)), size);
        R::select(inside, x, bound * R::constant(pieces[corner]))
    }

    #[inline(always)]
    fn margin(&self) -> R::Plain {
        self.margin
    }
}

/// +1 or -1.
#[inline(always)]
fn side<V: Real>(x: V) -> V {
    V::select(x.lt(V::zero()), V::splat(-1.0), V::splat(1.0))
}
