//! Results as bits.

use hdfast::batch::{Numbers, Outputs};

/// Values and derivatives in some places.
fn at(numbers: &Numbers, places: impl Iterator<Item = usize>) -> Vec<f64> {
    let width = numbers.tangents.len().checked_div(numbers.values.len()).unwrap_or(0);
    let both = |place: usize| {
        let tangents = &numbers.tangents[place * width..(place + 1) * width];
        std::iter::once(numbers.values[place]).chain(tangents.iter().copied())
    };
    places.flat_map(both).collect()
}

/// All numbers of one row, as bits.
pub fn bits(outputs: &Outputs, row: usize) -> Vec<u64> {
    let rows = outputs.status.len();
    let metrics = at(&outputs.metrics, (row..outputs.metrics.values.len()).step_by(rows));
    let states = at(&outputs.final_state, row * outputs.states..(row + 1) * outputs.states);
    let signals = outputs.samples.values.len() / (rows * outputs.times).max(1);
    let times = |k: usize| (k * rows + row) * outputs.times..(k * rows + row + 1) * outputs.times;
    let samples = at(&outputs.samples, (0..signals).flat_map(times));
    let counts = [outputs.status[row], outputs.method[row]].map(u64::from);
    let steps = [outputs.steps[row], outputs.rejected[row]].map(u64::from);
    let numbers = [metrics, states, samples, vec![outputs.time[row]]].concat();
    numbers.iter().map(|value| value.to_bits()).chain(counts).chain(steps).collect()
}
