//! What holds a drive before it begins.

use crate::real::Real;

/// What has wound a drive up for so long that all of it is in equilibrium and nothing creeps any more.
pub struct Wound<R> {
    /// Load torque, which payload, gear and housing carry [N m].
    pub load_torque: R,
    /// Windup of the gear under it [rad].
    pub windup: R,
    /// Torque asked of the drive [N m].
    pub motor_torque: R,
    /// Windup that the structure adds [rad].
    pub added_windup: R,
    /// 1 / ratio.
    pub inverse_ratio: R,
}

/// The twist [rad] at which a spring carries a torque; none where there is no spring.
#[inline(always)]
pub fn twist<R: Real>(torque: R, stiffness: R) -> R {
    R::select(R::zero().lt(stiffness), torque / stiffness, R::zero())
}
