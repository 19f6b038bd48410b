//! A clearance that the spring has to cross.

use super::sizes::WINDUP;
use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct Backlash;

impl Term for Backlash {
    const INFO: TermInfo = TermInfo {
        id: "backlash",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Clearance between wave generator and output: the spring carries nothing inside the gap.",
        equation: "tau_s(dz(phi)), dz = phi - b sgn(phi) outside abs(phi) <= b, else 0",
        source: "Nordin, Gutman 2002; half of the 8 arcsec of an Oldham coupling at ratio 120",
        amplitude: "half_gap",
        parameters: &[TermParameter::new("half_gap", "rad", "half of the gap at the output")
            .symbol("b")
            .size_25(1.9e-5, 5e-6, 0.00015)
            .within(0.0, f64::INFINITY)],
        states: &[],
    };
    const CORNERS: usize = 1;

    #[inline(always)]
    fn gear<R: Real>(p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, mut hidden: Hidden<R>) {
        gear.spring_windup = gear.spring_windup - hidden.clamp(0, gear.spring_windup, p[0], WINDUP);
    }
}
