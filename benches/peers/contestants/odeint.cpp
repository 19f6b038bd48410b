// Boost.odeint, row by row, states divided by their sizes as its tolerances are two numbers.
#include <array>
#include <boost/numeric/odeint.hpp>

#include <algorithm>

#include "problem.hpp"

namespace odeint = boost::numeric::odeint;

template <int Count>
using State = std::array<double, Count>;

template <int Count>
struct System {
    Row<double> p;
    Rates<double> evaluate(const State<Count>& u, double t) const {
        double y[states];
        for (int i = 0; i < states; ++i) y[i] = u[i] * floors[i];
        return rates(p, t, y);
    }
    void operator()(const State<Count>& u, State<Count>& out, double t) const {
        const Rates<double> r = evaluate(u, t);
        for (int i = 0; i < states; ++i) out[i] = r.slope[i] / floors[i];
        if constexpr (Count > states) {
            const double te = u[2] * floors[2];
            out[5] = te * 1e-30;
            out[6] = te * te * 1e-30;
        }
    }
};

template <int Count, class Stepper>
void solve(const double* parameters, long rows, double rtol, double* final, double* peak, double* rms) {
    for (long row = 0; row < rows; ++row) {
        const double* q = parameters + row * columns;
        System<Count> system{{1 / q[0], 1 / q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], q[9], q[10], 0, 0}};
        State<Count> u{};
        u[2] = windup_free_te(q[9]) / floors[2];
        double highest = 0, opening[2]{};
        for (int s = 0; s < 5; ++s) {
            system.p.reference_rate = q[10] * reference_slope[s];
            system.p.reference_at_zero = q[10] * (reference_from[s] - reference_slope[s] * begins[s]);
            auto stepper = odeint::make_controlled(rtol, rtol, Stepper());
            if constexpr (Count > states)
                odeint::integrate_adaptive(stepper, std::ref(system), u, begins[s], stops[s], 1e-4,
                                           [&](const State<Count>& v, double t) {
                                               highest = std::max(highest, std::abs(system.evaluate(v, t).windup));
                                           });
            else
                odeint::integrate_adaptive(stepper, std::ref(system), u, begins[s], stops[s], 1e-4);
            if constexpr (Count > states)
                for (int i = 0; i < 2; ++i) {
                    if (s == 1) opening[i] = u[5 + i] * 1e30;
                    if (s == 2) opening[i] = u[5 + i] * 1e30 - opening[i];
                }
        }
        for (int i = 0; i < states; ++i) final[row * states + i] = u[i] * floors[i];
        peak[row] = highest;
        rms[row] = std::sqrt(opening[1] - opening[0] * opening[0]);
    }
}

template <int Count>
void choose(int method, const double* parameters, long rows, double rtol, double* final, double* peak, double* rms) {
    using S = State<Count>;
    if (method == 8)
        solve<Count, odeint::runge_kutta_fehlberg78<S>>(parameters, rows, rtol, final, peak, rms);
    else
        solve<Count, odeint::runge_kutta_dopri5<S>>(parameters, rows, rtol, final, peak, rms);
}

extern "C" void sweep(int method, const double* parameters, long rows, double rtol, int full, int, double* final, double* peak,
                      double* rms) {
    full ? choose<7>(method, parameters, rows, rtol, final, peak, rms) : choose<5>(method, parameters, rows, rtol, final, peak, rms);
}
