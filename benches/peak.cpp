// Fused multiply-adds per second of one core: twelve independent chains hide the latency.
#include <chrono>

using Wide = double __attribute__((vector_size(64)));
using Narrow = double __attribute__((vector_size(32)));

template <class Vector>
double rate(double seconds) {
    Vector x[12];
    const Vector factor = Vector{} + 0.999999, addend = Vector{} + 1e-6;
#pragma GCC unroll 12
    for (int i = 0; i < 12; ++i) x[i] = Vector{} + i;  // unrolled like the loop below, or the chains live in memory
    const auto now = [] { return std::chrono::steady_clock::now(); };
    const auto begin = now();
    double count = 0, elapsed = 0;
    while (elapsed < seconds) {
        for (int turn = 0; turn < 10000; ++turn) {
#pragma GCC unroll 12
            for (int i = 0; i < 12; ++i) {
                x[i] = x[i] * factor + addend;
                asm volatile("" : "+v"(x[i]));
            }
        }
        count += 12 * 10000.0 * (sizeof(Vector) / sizeof(double));
        elapsed = std::chrono::duration<double>(now() - begin).count();
    }
    return count / elapsed;
}

extern "C" double fused_multiply_adds(int bytes, double seconds) { return bytes == 64 ? rate<Wide>(seconds) : rate<Narrow>(seconds); }
