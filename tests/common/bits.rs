//! Results as bits.

use hdfast::batch::Outputs;

/// All numbers of one row, as bits.
pub fn bits(outputs: &Outputs, row: usize) -> Vec<u64> {
    let rows = outputs.status.len();
    let metrics = outputs.metrics.iter().skip(row).step_by(rows);
    let states = outputs.final_state[row * outputs.states..(row + 1) * outputs.states].iter();
    let signals = outputs.samples.len() / (rows * outputs.times).max(1);
    let samples = (0..signals).flat_map(|k| {
        let start = (k * rows + row) * outputs.times;
        &outputs.samples[start..start + outputs.times]
    });
    let counts = [outputs.status[row].into(), outputs.steps[row].into(), outputs.rejected[row].into()];
    let numbers = metrics.chain(states).chain(samples).chain([&outputs.time[row]]);
    numbers.map(|value| value.to_bits()).chain(counts).collect()
}
