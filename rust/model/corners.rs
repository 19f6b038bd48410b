//! Corners: where a law bends without a jump.
//!
//! A law with corners is made of smooth pieces. The piece on which a step begins is held until the step ends, also
//! beyond the corner, so that the equations are smooth inside every step; how much of the piece is left tells whether
//! the step has to be cut short.

use crate::real::Real;

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
    /// `x` limited to `[-bound, bound]`. `size` is the size of `x` below which relative accuracy is not asked for.
    fn clamp(&mut self, corner: usize, x: R, bound: R, size: f64) -> R;
    /// Lanes in which a corner plays no part.
    fn ignore(&mut self, corner: usize, lanes: R::Mask);
    /// How much is left of the pieces of a base model, in natural sizes.
    fn margin_of_base(&self) -> R::Plain;
}

/// No corner is held and none is asked about.
pub struct Unheld;

impl<R: Real> Bends<R> for Unheld {
    #[inline(always)]
    fn are_held(&self) -> bool {
        false
    }

    #[inline(always)]
    fn clamp(&mut self, _corner: usize, x: R, bound: R, _size: f64) -> R {
        x.clamp_abs(bound)
    }

    #[inline(always)]
    fn ignore(&mut self, _corner: usize, _lanes: R::Mask) {}

    #[inline(always)]
    fn margin_of_base(&self) -> R::Plain {
        R::Plain::splat(f64::INFINITY)
    }
}

/// The corners at one evaluation of the equations.
pub struct Corners<'a, R: Real> {
    /// The pieces that are held; where there are none, every law is on the piece on which it lies.
    held: Option<&'a Pieces<R::Plain>>,
    /// How much is left of every piece that is held, or the pieces where none is.
    found: Pieces<R::Plain>,
}

impl<'a, R: Real> Corners<'a, R> {
    /// Nothing found yet.
    #[inline(always)]
    pub fn new(held: Option<&'a Pieces<R::Plain>>) -> Self {
        let unused = if held.is_some() { f64::INFINITY } else { 0.0 };
        Self { held, found: [R::Plain::splat(unused); CORNERS] }
    }

    /// What every corner has found.
    #[inline(always)]
    pub fn found(self) -> Pieces<R::Plain> {
        self.found
    }

    /// How much is left of all pieces, in natural sizes.
    #[inline(always)]
    pub fn margin(&self) -> R::Plain {
        self.found[OF_TERMS..].iter().fold(self.margin_of_base(), |least, &margin| least.min(margin))
    }

    /// The sign of `x`: +1 or -1.
    #[inline(always)]
    pub fn sign(&mut self, corner: usize, x: R, size: f64) -> R {
        let piece = self.side(corner, x.plain());
        self.note(corner, x.plain() * piece, size);
        R::constant(piece)
    }

    /// The smaller of two numbers of a size.
    #[inline(always)]
    pub fn min(&mut self, corner: usize, left: R, right: R, size: f64) -> R {
        let apart = right.plain() - left.plain();
        let piece = self.side(corner, apart);
        self.note(corner, piece * apart, size);
        R::select(R::Plain::zero().lt(piece), left, right)
    }

    /// The piece on one side of zero, held or where `x` is.
    #[inline(always)]
    fn side(&mut self, corner: usize, x: R::Plain) -> R::Plain {
        if let Some(pieces) = self.held {
            return pieces[corner];
        }
        self.found[corner] = side(x);
        self.found[corner]
    }

    #[inline(always)]
    fn note(&mut self, corner: usize, left: R::Plain, size: f64) {
        if self.held.is_some() {
            self.found[corner] = left * R::Plain::splat(1.0 / size);
        }
    }
}

impl<R: Real> Bends<R> for Corners<'_, R> {
    #[inline(always)]
    fn are_held(&self) -> bool {
        self.held.is_some()
    }

    #[inline(always)]
    fn clamp(&mut self, corner: usize, x: R, bound: R, size: f64) -> R {
        let zero = R::Plain::zero();
        let (place, end) = (x.plain(), bound.plain());
        let Some(pieces) = self.held else {
            self.found[corner] = R::Plain::select(end.lt(place.abs()), side(place), zero);
            return x.clamp_abs(bound);
        };
        let inside = pieces[corner].abs().le(zero);
        let left = R::Plain::select(inside, end - place.abs(), pieces[corner] * place - end);
        self.note(corner, left, size);
        R::select(inside, x, bound * R::constant(pieces[corner]))
    }

    #[inline(always)]
    fn ignore(&mut self, corner: usize, lanes: R::Mask) {
        if self.held.is_some() {
            self.found[corner] = R::Plain::select(lanes, R::Plain::splat(f64::INFINITY), self.found[corner]);
        }
    }

    #[inline(always)]
    fn margin_of_base(&self) -> R::Plain {
        self.found[TORQUE_LIMIT].min(self.found[KNEES[0]]).min(self.found[KNEES[1]])
    }
}

/// +1 or -1.
#[inline(always)]
fn side<V: Real>(x: V) -> V {
    V::select(x.lt(V::zero()), V::splat(-1.0), V::splat(1.0))
}
