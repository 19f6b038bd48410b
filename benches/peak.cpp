// Fused multiply-adds per second of one core: twelve independent chains hide the latency.
#include <chrono>

template <int Bytes>
double rate(double seconds) {
    using Vector = double __attribute__((vector_size(Bytes)));
    Vector x[12];
    const Vector factor = Vector{} + 0.999999, addend = Vector{} + 1e-6;
    for (int i = 0; i < 12; ++i) x[i] = Vector{} + i;
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
        count += 12 * 10000.0 * (Bytes / 8);
        elapsed = std::chrono::duration<double>(now() - begin).count();
    }
    return count / elapsed;
}

extern "C" double fused_multiply_adds(int bytes, double seconds) { return bytes == 64 ? rate<64>(seconds) : rate<32>(seconds); }
