//! The benchmark problem on every CPU path and by every method, one thread, rows per second.
//!
//! Profile with `cargo bench --bench sweep -- --profile-time 10 avx512` under a sampling profiler.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Problem, layout, random_rows};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use hdfast::batch::{MethodName, paths};
use hdfast::model::Base;
use hdfast::output::Metric;
use std::time::Duration;

const ROWS: usize = 512;

fn problem(metrics: &[&str]) -> Problem {
    let metric = |name: &&str| Metric::from_name(name, |_| None).expect("a known metric").metric;
    Problem {
        metrics: metrics.iter().map(metric).collect(),
        signals: Vec::new(),
        ..Problem::new(random_rows(&layout(Base::TwoInertia), ROWS))
    }
}

fn cpu_paths(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("path");
    group.throughput(Throughput::Elements(ROWS as u64));
    for path in paths() {
        let problem = Problem { path, ..problem(&["te_rms", "peak_windup"]) };
        group.bench_function(BenchmarkId::from_parameter(path.name()), |bencher| bencher.iter(|| problem.run()));
    }
    group.finish();
}

fn methods(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("method");
    group.throughput(Throughput::Elements(ROWS as u64));
    let methods = [("tsit5", MethodName::Tsit5), ("dopri5", MethodName::Dopri5), ("dop853", MethodName::Dop853)];
    for (name, method) in methods {
        let problem = Problem { method, ..problem(&["te_rms", "peak_windup"]) };
        group.bench_function(name, |bencher| bencher.iter(|| problem.run()));
    }
    group.finish();
}

fn outputs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("output");
    group.throughput(Throughput::Elements(ROWS as u64));
    let all: Vec<String> = Metric::catalogue().iter().map(|entry| entry.name.clone()).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let cases: [(&str, &[&str]); 3] =
        [("final_state", &[]), ("rms_and_peak", &["te_rms", "peak_windup"]), ("all_metrics", &all)];
    for (name, metrics) in cases {
        let problem = problem(metrics);
        group.bench_function(name, |bencher| bencher.iter(|| problem.run()));
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(3));
    targets = cpu_paths, methods, outputs
}
criterion_main!(benches);
