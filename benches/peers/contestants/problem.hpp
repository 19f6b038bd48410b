// The benchmark problem for C++ solvers, generic in the number type.
#pragma once
#include <cmath>

constexpr double ratio = 121.0, k_p = 0.05, k_i = 0.8;
constexpr int columns = 11, orders = 15, states = 5;
constexpr double stops[] = {0.5, 1.0, 2.0, 2.5, 3.0};
constexpr double reference_from[] = {0, 1, 1, 1, 0}, reference_slope[] = {2, 0, 0, -2, 0}, begins[] = {0, 0.5, 1.0, 2.0, 2.5};
constexpr double floors[states] = {0.1, 0.1, 1e-5, 1e-3, 1e-2};

struct Coefficients {
    double a[orders], b[orders];
    Coefficients() {
        for (int n = 0; n < orders; ++n) {
            const double k = n + 1, amplitude = n == 1 ? 1.5e-4 : 0.4e-4;
            a[n] = -amplitude * std::cos(1.7 * k) / std::pow(k, 1.2);
            b[n] = -amplitude * std::sin(2.3 * k) / std::pow(k, 1.2);
        }
    }
};
inline const Coefficients coefficients;

inline double windup_free_te(double scale) {
    double sum = 0;
    for (double a : coefficients.a) sum += a;
    return scale * sum;
}

// One row, or one row per lane: divisions are done once, when a row begins.
template <class T>
struct Row {
    T inverse_j_m, inverse_j_l, b_m, b_l, b_ml, b_sp, k1, k3, k5, scale, speed;
    T reference_at_zero, reference_rate;  // of the present segment
};

// sin_cos(angle, sine, cosine) is found by the type of its arguments.
inline void sin_cos(double x, double& s, double& c) {
    s = std::sin(x);
    c = std::cos(x);
}

template <class T>
struct Rates {
    T slope[states], windup, windup_rate;
};

template <class T>
[[gnu::always_inline]] inline Rates<T> rates(const Row<T>& p, const T& t, const T y[states]) {
    T s1, c1;
    sin_cos(y[0], s1, c1);
    const T twice = c1 + c1;
    T c = c1, s = s1, c_before = T(1.0) + c1 * 0.0, s_before = s1 * 0.0;
    T error = c * 0.0, slope = error;
#pragma GCC unroll 15
    for (int n = 0; n < orders; ++n) {
        const double a = coefficients.a[n], b = coefficients.b[n];
        error = error + (c * a + s * b);
        slope = slope + (c * ((n + 1) * b) - s * ((n + 1) * a));
        const T c_next = twice * c - c_before, s_next = twice * s - s_before;
        c_before = c, s_before = s, c = c_next, s = s_next;
    }
    Rates<T> r;
    r.windup = y[2] - p.scale * error;
    const T upsilon = T(1 / ratio) - p.scale * slope, square = r.windup * r.windup;
    r.windup_rate = upsilon * y[1] - y[3];
    const T gear = r.windup * (p.k1 + square * (p.k3 + square * p.k5)) + p.b_sp * r.windup_rate;
    const T off = p.reference_at_zero + p.reference_rate * t - y[1];
    const T slip = p.b_ml * (y[1] - y[3]);
    r.slope[0] = y[1];
    r.slope[1] = (off * k_p + y[4] * k_i - p.b_m * y[1] - slip - upsilon * gear) * p.inverse_j_m;
    r.slope[2] = y[1] * (1 / ratio) - y[3];
    r.slope[3] = (gear - p.b_l * y[3] + slip) * p.inverse_j_l;
    r.slope[4] = off;
    return r;
}
