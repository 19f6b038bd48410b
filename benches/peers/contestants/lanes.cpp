// Runge-Kutta in SIMD lanes by hand: 16 rows at once in two vectors of 8, each with its own time and step; a lane that
// ends its row takes the next one. Two vectors in flight hide the latency of the harmonic recurrence.
#include <atomic>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "tableaus.hpp"

using Vector = double __attribute__((vector_size(64)));
using Bits = long long __attribute__((vector_size(64)));
constexpr int vectors = 2, width = 8, lanes = vectors * width;

struct Mask {
    Bits x[vectors];
    unsigned bits() const {
        unsigned out = 0;
        for (int v = 0; v < vectors; ++v)
            for (int i = 0; i < width; ++i) out |= unsigned(x[v][i] & 1) << (v * width + i);
        return out;
    }
    Mask operator&(const Mask& o) const { return {{x[0] & o.x[0], x[1] & o.x[1]}}; }
};

struct Lanes {
    Vector x[vectors];
    Lanes() = default;
    Lanes(double value) : x{Vector{} + value, Vector{} + value} {}
    Lanes(Vector a, Vector b) : x{a, b} {}
    double get(int lane) const { return x[lane / width][lane % width]; }
    void set(int lane, double value) { x[lane / width][lane % width] = value; }
};
#define OPERATOR(o) \
    [[gnu::always_inline]] inline Lanes operator o(const Lanes& a, const Lanes& b) { return {a.x[0] o b.x[0], a.x[1] o b.x[1]}; }
OPERATOR(+) OPERATOR(-) OPERATOR(*) OPERATOR(/)
#undef OPERATOR
[[gnu::always_inline]] inline Lanes operator*(const Lanes& a, double b) { return {a.x[0] * b, a.x[1] * b}; }
[[gnu::always_inline]] inline Mask less_or_equal(const Lanes& a, const Lanes& b) { return {{a.x[0] <= b.x[0], a.x[1] <= b.x[1]}}; }
[[gnu::always_inline]] inline Lanes choose(const Mask& m, const Lanes& a, const Lanes& b) {
    return {m.x[0] ? a.x[0] : b.x[0], m.x[1] ? a.x[1] : b.x[1]};
}
[[gnu::always_inline]] inline Lanes largest(const Lanes& a, const Lanes& b) {
    return {a.x[0] > b.x[0] ? a.x[0] : b.x[0], a.x[1] > b.x[1] ? a.x[1] : b.x[1]};
}
[[gnu::always_inline]] inline Lanes magnitude(const Lanes& a) { return largest(a, Lanes(0.0) - a); }

// Reduction to +-pi/4 in two parts of pi/2, then the polynomials of the Cephes library.
[[gnu::always_inline]] inline void sin_cos(const Vector& x, Vector& s, Vector& c) {
    const Vector shift = Vector{} + 6755399441055744.0, shifted = x * 0.63661977236758134308 + shift;
    Bits quadrant;
    std::memcpy(&quadrant, &shifted, sizeof quadrant);
    const Vector turns = shifted - shift;
    Vector r = x - turns * 1.5707963267948966192;
    r = r - turns * 6.123233995736766036e-17;
    const Vector z = r * r;
    Vector p = z * 1.58962301576546568060e-10 - 2.50507477628578072866e-8;
    p = p * z + 2.75573136213857245213e-6;
    p = p * z - 1.98412698295895385996e-4;
    p = p * z + 8.33333333332211858878e-3;
    p = p * z - 1.66666666666666307295e-1;
    const Vector sine = r + r * z * p;
    Vector q = z * -1.13585365213876817300e-11 + 2.08757008419747316778e-9;
    q = q * z - 2.75573141792967388112e-7;
    q = q * z + 2.48015872888517045348e-5;
    q = q * z - 1.38888888888730564116e-3;
    q = q * z + 4.16666666666665929218e-2;
    const Vector cosine = 1.0 - 0.5 * z + z * z * q;
    const Bits odd = -(quadrant & 1), high = (quadrant & 2) << 62, next = ((quadrant + 1) & 2) << 62;
    s = odd ? cosine : sine;
    c = odd ? sine : cosine;
    s = (Vector)((Bits)s ^ high);
    c = (Vector)((Bits)c ^ next);
}
[[gnu::always_inline]] inline void sin_cos(const Lanes& x, Lanes& s, Lanes& c) {
    for (int v = 0; v < vectors; ++v) sin_cos(x.x[v], s.x[v], c.x[v]);
}

#include "problem.hpp"

// sum of weights[j] * k[j], zero weights skipped at compile time
template <const double* Weights, int Count, class Slopes>
[[gnu::always_inline]] inline Lanes weighted(const Slopes& k, int index) {
    Lanes sum(0.0);
    [&]<int... J>(std::integer_sequence<int, J...>) {
        ((Weights[J] != 0.0 ? void(sum = sum + k[J][index] * Weights[J]) : void()), ...);
    }(std::make_integer_sequence<int, Count>{});
    return sum;
}

struct Sweep {
    const double* parameters;
    long rows;
    double rtol;
    double *final, *peak, *rms;
    std::atomic<long> next{0};
};

template <class Method, bool Full>
void work(Sweep& sweep) {
    constexpr int stages = Method::stages;
    Row<Lanes> p;
    Lanes y[states], t(0.0), stop(0.0), step(1e-4), before(1.0), peak(0.0), integrals[2]{0.0, 0.0}, opening[2]{0.0, 0.0};
    Lanes k[stages + 1][states], te[stages];
    Rates<Lanes> now;
    long row[lanes];
    int segment[lanes];
    unsigned occupied = 0;
    bool stale = true;

    auto enter = [&](int lane, int s) {
        segment[lane] = s;
        stop.set(lane, stops[s]);
        const double speed = p.speed.get(lane);
        p.reference_rate.set(lane, speed * reference_slope[s]);
        p.reference_at_zero.set(lane, speed * (reference_from[s] - reference_slope[s] * begins[s]));
    };
    auto seat = [&](int lane) {
        const long index = sweep.next++;
        occupied &= ~(1u << lane);
        stop.set(lane, INFINITY);
        if (index >= sweep.rows) return;
        occupied |= 1u << lane;
        row[lane] = index;
        const double* q = sweep.parameters + index * columns;
        Lanes* const into[] = {&p.inverse_j_m, &p.inverse_j_l, &p.b_m, &p.b_l, &p.b_ml, &p.b_sp, &p.k1, &p.k3, &p.k5, &p.scale, &p.speed};
        for (int i = 0; i < columns; ++i) into[i]->set(lane, i < 2 ? 1 / q[i] : q[i]);
        for (auto& state : y) state.set(lane, 0.0);
        y[2].set(lane, windup_free_te(q[9]));
        for (Lanes* x : {&t, &peak, &integrals[0], &integrals[1]}) x->set(lane, 0.0);
        before.set(lane, 1.0);
        step.set(lane, 1e-4);
        enter(lane, 0);
        stale = true;
    };
    for (Lanes* x : {&p.inverse_j_m, &p.inverse_j_l, &p.b_m, &p.b_l, &p.b_ml, &p.b_sp, &p.k1, &p.k3, &p.k5, &p.scale, &p.speed,
                     &p.reference_at_zero, &p.reference_rate, &y[0], &y[1], &y[2], &y[3], &y[4]})
        *x = Lanes(0.0);
    for (int lane = 0; lane < lanes; ++lane) seat(lane);

    while (occupied) {
        if (stale) {
            now = rates(p, t, y);
            std::memcpy(k[0], now.slope, sizeof now.slope);
            stale = false;
        }
        const Lanes left = stop - t;
        const Mask landing = less_or_equal(left, step * 1.01);
        const Lanes h = choose(landing, left, step);
        if constexpr (Full) te[0] = y[2];
        Lanes trial[states];
        Rates<Lanes> last;
        [&]<int... S>(std::integer_sequence<int, S...>) {
            (([&] {
                 constexpr int stage = S + 1;
                 constexpr const double* weights = Method::weights[stage];
                 for (int i = 0; i < states; ++i) trial[i] = y[i] + h * weighted<weights, stage>(k, i);
                 last = rates(p, t + h * Method::nodes[stage], trial);
                 std::memcpy(k[stage], last.slope, sizeof last.slope);
                 if constexpr (Full && stage < stages) te[stage] = trial[2];
             }()),
             ...);
        }(std::make_integer_sequence<int, stages>{});

        Lanes first(0.0), second(0.0);
        for (int i = 0; i < states; ++i) {
            const Lanes size = i == 0 ? Lanes(floors[0]) : largest(magnitude(y[i]), magnitude(trial[i])) + floors[i];
            const Lanes inverse = Lanes(1.0) / size;
            const Lanes e = weighted<Method::error, stages + 1>(k, i) * inverse;
            first = first + e * e;
            if constexpr (Method::has_second_error) {
                const Lanes f = weighted<Method::second_error, stages + 1>(k, i) * inverse;
                second = second + f * f;
            }
        }
        Lanes square = first * h * h * (1 / (states * sweep.rtol * sweep.rtol));
        if constexpr (Method::has_second_error) square = square * first / (first + second * 0.01 + 1e-300);
        const Mask accepted = less_or_equal(square, Lanes(1.0));

        Lanes factor;
        for (int lane = 0; lane < lanes; ++lane) {
            const double norm = square.get(lane), past = before.get(lane);
            constexpr double order = Method::order;
            double f = norm <= 1 ? 0.9 * std::exp2f(float(-0.35 / order) * std::log2f(float(norm) + 1e-20f) +
                                                    float(0.1 / order) * std::log2f(float(past) + 1e-20f))
                                 : 0.9 * std::exp2f(float(-0.5 / order) * std::log2f(float(norm)));
            factor.set(lane, f > 6 ? 6 : f > 0.2 ? f : 0.2);
        }
        before = choose(accepted, square, before);
        if constexpr (Full) {
            Lanes sum(0.0), squares(0.0);
            [&]<int... J>(std::integer_sequence<int, J...>) {
                ((Method::weights[stages][J] != 0.0
                      ? void((sum = sum + te[J] * Method::weights[stages][J], squares = squares + te[J] * te[J] * Method::weights[stages][J]))
                      : void()),
                 ...);
            }(std::make_integer_sequence<int, stages>{});
            integrals[0] = choose(accepted, integrals[0] + h * sum, integrals[0]);
            integrals[1] = choose(accepted, integrals[1] + h * squares, integrals[1]);
            peak = choose(accepted, largest(peak, magnitude(last.windup)), peak);
        }
        t = choose(accepted, choose(landing, stop, t + h), t);
        for (int i = 0; i < states; ++i) {
            y[i] = choose(accepted, trial[i], y[i]);
            k[0][i] = choose(accepted, last.slope[i], k[0][i]);
        }
        const Mask arrived = accepted & landing;
        const Lanes wanted = h * factor;
        step = choose(arrived, largest(step, wanted), wanted);
        for (unsigned bits = arrived.bits() & occupied; bits; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            for (int q = 0; Full && q < 2; ++q) {
                if (segment[lane] == 1) opening[q].set(lane, integrals[q].get(lane));
                if (segment[lane] == 2) opening[q].set(lane, integrals[q].get(lane) - opening[q].get(lane));
            }
            if (segment[lane] < 4) {
                enter(lane, segment[lane] + 1);
                continue;
            }
            for (int i = 0; i < states; ++i) sweep.final[row[lane] * states + i] = y[i].get(lane);
            if (Full) {
                const double mean = opening[0].get(lane);
                sweep.peak[row[lane]] = peak.get(lane);
                sweep.rms[row[lane]] = std::sqrt(opening[1].get(lane) - mean * mean);
            }
            seat(lane);
        }
        const unsigned hopeless = less_or_equal(h, (t + 1e-3) * 1e-15).bits() & ~arrived.bits() & occupied;
        for (unsigned bits = hopeless; bits; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            sweep.peak[row[lane]] = sweep.rms[row[lane]] = NAN;
            for (int i = 0; i < states; ++i) sweep.final[row[lane] * states + i] = NAN;
            seat(lane);
        }
    }
}

template <class Method>
void run(Sweep& sweep, bool full, int threads) {
    auto task = [&] { full ? work<Method, true>(sweep) : work<Method, false>(sweep); };
    std::vector<std::thread> pool;
    for (int i = 1; i < threads; ++i) pool.emplace_back(task);
    task();
    for (auto& thread : pool) thread.join();
}

extern "C" void sweep(int method, const double* parameters, long rows, double rtol, int full, int threads, double* final,
                      double* peak, double* rms) {
    Sweep all{parameters, rows, rtol, final, peak, rms};
    method == 8 ? run<Dop853>(all, full, threads) : run<Dopri5>(all, full, threads);
}
