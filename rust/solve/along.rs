//! How the equations change along a direction of states and time, with everything else held.

use crate::model::terms::Terms;
use crate::model::{Constants, Drivetrain, Harmonics, Input, Model, Pieces, Spring};
use crate::real::{Dual, Real};

/// Room for what of a drive is large.
pub struct Along<V: Real<Plain = V, Lane = f64>> {
    harmonics: Harmonics<Dual<V>>,
    terms: Terms<Dual<V>>,
}

/// A drive that nothing but states and time can change.
pub struct Held<'a, V: Real<Plain = V, Lane = f64>> {
    constants: Constants<Dual<V>>,
    harmonics: &'a Harmonics<Dual<V>>,
    input: Input<Dual<V>>,
    spring: Spring,
    terms: &'a Terms<Dual<V>>,
    directions: [Dual<V>; 2],
    pieces: Option<&'a Pieces<V>>,
}

impl<V: Real<Plain = V, Lane = f64>> Along<V> {
    pub fn new<R: Real<Plain = V>>(harmonics: &Harmonics<R>, terms: &Terms<R>) -> Self {
        Self { harmonics: harmonics.map(held), terms: terms.map(held) }
    }

    #[inline(always)]
    pub fn hold<'a, R: Real<Plain = V>>(&'a mut self, drive: &Drivetrain<'a, R>) -> Held<'a, V> {
        self.harmonics.copy_from(drive.harmonics, held);
        self.terms.copy_from(drive.terms, held);
        Held {
            constants: drive.constants.map(held),
            harmonics: &self.harmonics,
            input: drive.input.map(held),
            spring: drive.spring,
            terms: &self.terms,
            directions: drive.directions.map(held),
            pieces: drive.pieces,
        }
    }
}

impl<V: Real<Plain = V, Lane = f64>> Held<'_, V> {
    /// The change of the slopes along a direction of the states, and of time: its value and how far it goes along.
    #[inline(always)]
    pub fn change<M: Model<N>, const N: usize>(&self, (t, ahead): (V, V), state: &[V; N], along: &[V; N]) -> [V; N] {
        let drive = Drivetrain {
            constants: &self.constants,
            harmonics: self.harmonics,
            input: &self.input,
            spring: self.spring,
            terms: self.terms,
            directions: &self.directions,
            pieces: self.pieces,
        };
        let mut moved = [Dual::zero(); N];
        for index in 0..N {
            moved[index] = Dual::constant(state[index]).with_tangent(along[index]);
        }
        let slopes = M::rates(&drive, Dual::constant(t).with_tangent(ahead), &moved).slope;
        let mut change = [V::zero(); N];
        for index in 0..N {
            change[index] = slopes[index].tangent();
        }
        change
    }
}

/// A number that the direction leaves alone.
#[inline(always)]
fn held<R: Real<Plain = V>, V: Real<Plain = V, Lane = f64>>(number: R) -> Dual<V> {
    Dual::constant(number.plain())
}
