//! Properties of the model that hold for any drive.

mod common;

use common::{Problem, layout, random_rows};
use hdfast::batch::MethodName;
use hdfast::model::Base;
use hdfast::output::Metric;
use proptest::prelude::*;

fn metric(name: &str) -> Metric {
    Metric::from_name(name, |_| None).expect("a known metric").metric
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn exact_energy_balance(
        j_l in 0.05..12.0f64,
        b_sp in 2.0..100.0f64,
        te_scale in 0.0..3.0f64,
        slip in 0.0..1.0f64,
        speed in -60.0..60.0f64,
        one_inertia in any::<bool>(),
    ) {
        let base = if one_inertia { Base::OneInertia } else { Base::TwoInertia };
        let layout = layout(base);
        let mut row = random_rows(&layout, 1).remove(0);
        (row[2], row[6], row[7]) = (j_l, b_sp, slip);
        row[layout.te_scale()] = te_scale;
        row[layout.scenario(hdfast::model::ScenarioColumn::OmegaSet)] = speed;
        for method in [MethodName::Tsit5, MethodName::Dop853] {
            let mut problem = Problem::new(vec![row.clone()]);
            problem.base = base;
            problem.method = method;
            problem.rtol = 1e-9;
            problem.metrics = vec![metric("energy_residual"), metric("loss_mesh"), metric("loss_load")];
            let outputs = problem.run();
            prop_assert_eq!(outputs.status[0], 0);
            prop_assert!(outputs.metrics.values[0] < 1e-7, "residual {}", outputs.metrics.values[0]);
            prop_assert!(outputs.metrics.values[1] >= 0.0 && outputs.metrics.values[2] >= 0.0);
        }
    }

    #[test]
    fn exact_peaks_bound_every_sample(seed in 0usize..200) {
        let row = random_rows(&layout(Base::TwoInertia), seed + 1).remove(seed);
        let mut problem = Problem::new(vec![row]);
        problem.metrics = vec![metric("te_peak_start"), metric("te_peak"), metric("te_peak_stop")];
        let outputs = problem.run();
        let peak = outputs.metrics.values.iter().copied().fold(0.0, f64::max);
        let highest = outputs.samples.values[..outputs.times].iter().fold(0.0, |top: f64, te| top.max(te.abs()));
        prop_assert!(highest <= peak * (1.0 + 1e-6), "{highest} above {peak}");
    }
}
