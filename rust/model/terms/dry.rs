//! What resists the motion of a shaft.

use crate::real::Real;

/// Dry friction on one shaft: a level that opposes the motion, or holds it.
#[derive(Clone, Copy)]
pub struct Dry<R> {
    /// Level while sliding [N m], at least 0.
    pub level: R,
    /// Level that must be exceeded to break away from rest [N m].
    pub breakaway: R,
    /// Direction of sliding: +1, -1, or 0 at rest.
    pub direction: R,
    /// Half of what the dry levels of forward and backward motion differ by [N m].
    pub bias: R,
    /// Further resisting torque that is neither dry nor that of the dampers [N m].
    pub resisting: R,
    /// Torque of the motor's dampers on the shaft without terms [N m].
    pub viscous: R,
    /// Torque that they hand on to the output [N m at the output].
    pub handed_on: R,
    /// Factor on both; like `grip` and `lean` set by terms that act before the laws.
    pub drag: R,
    /// Of a shaft that is held: the share by which its dampers would pull more on it forward, and less backward.
    pub held_apart: R,
    /// Factor on the friction of the laws.
    pub grip: R,
    /// What their dry levels gain forward and lose backward, as a share.
    pub lean: R,
    /// Gear torque [N m at the output]; motor friction may be linear in it and in its size, no more.
    pub gear_torque: R,
}

/// Where a shaft that slides in this direction rests.
#[inline(always)]
pub fn at_rest<R: Real>(direction: R) -> R::Mask {
    direction.abs().le(R::zero())
}

impl<R: Real> Dry<R> {
    /// The motor before the terms have their say; `dampers` are the torques of its dampers on it and on the output.
    #[inline(always)]
    pub fn of_motor(direction: R, [viscous, handed_on]: [R; 2], gear_torque: R) -> Self {
        let (zero, one) = (R::zero(), R::splat(1.0));
        Self {
            level: zero,
            breakaway: zero,
            direction,
            bias: zero,
            resisting: zero,
            viscous,
            handed_on,
            drag: one,
            held_apart: zero,
            grip: one,
            lean: zero,
            gear_torque,
        }
    }

    /// The output before the terms have their say: what changes the drag of the motor changes what it hands on.
    #[inline(always)]
    pub fn of_output(direction: R, motor: &Self) -> Self {
        let zero = R::zero();
        Self { drag: motor.drag, ..Self::of_motor(direction, [-motor.handed_on, zero], zero) }
    }

    /// Adds a dry law: its level while sliding and at breakaway, and half of what both directions differ by [N m].
    #[inline(always)]
    pub fn add(&mut self, level: R, breakaway: R, bias: R) {
        let resting = at_rest(self.direction);
        let apart = self.lean * bias;
        self.level = self.grip.mul_add(level + apart, self.level);
        self.breakaway = self.grip.mul_add(breakaway + apart, self.breakaway);
        self.bias = self.grip.mul_add(self.lean.mul_add(R::select(resting, breakaway, level), bias), self.bias);
    }

    /// Once all terms have had their say: what holds a shaft has to be exceeded by as much as its dampers would then pull
    /// more. They do where the shafts that they join move apart while this one rests.
    #[inline(always)]
    pub fn hold(&mut self) {
        self.breakaway = (self.held_apart * self.drag).mul_add(self.viscous, self.breakaway);
    }

    /// Factor on the level of a law that has no jump, at a way between -1 and 1.
    #[inline(always)]
    pub fn strength(&self, way: R) -> R {
        self.grip * self.lean.mul_add(way, R::splat(1.0))
    }

    /// Resisting torque of a shaft that slides, beyond that of its dampers [N m].
    #[inline(always)]
    pub fn torque(&self) -> R {
        self.direction.mul_add(self.level, self.either_way())
    }

    /// The part of it that is the same in both directions [N m].
    #[inline(always)]
    pub fn either_way(&self) -> R {
        self.bias + self.not_dry()
    }

    /// The part of it that is not dry [N m].
    #[inline(always)]
    pub fn not_dry(&self) -> R {
        (self.drag - R::splat(1.0)).mul_add(self.viscous, self.resisting)
    }
}
