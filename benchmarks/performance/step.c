/* One evaluation of the contact, and the three-layer scheme in backward slip, as C computes them: the same numbers
 * in the same order, one loop over the nodes with the number of nodes and of waves known to the compiler. */
#include <math.h>

static const double *F1, *SINES, *COSINES, *OMEGA;

void tables(const double *f1, const double *sines, const double *cosines, const double *omega) {
    F1 = f1, SINES = sines, COSINES = cosines, OMEGA = omega;
}

/* Out: the sums over the touching nodes of gap, 1, rise of f2 across the cell, gap squared, gap times rise. The
 * tables have one cell beyond each end. */
void evaluate(double x, double y, double travel, double *out) {
    double s[WAVES], c[WAVES], f2[NODES + 2], force = 0, touching = 0, rise = 0, square = 0, work = 0;
    for (int i = 0; i < WAVES; i++) {
        s[i] = sin(OMEGA[i] * (x - travel));
        c[i] = cos(OMEGA[i] * (x - travel));
    }
    for (int j = 0; j < NODES + 2; j++) {
        double sum = 0;
        for (int i = 0; i < WAVES; i++)
            sum += c[i] * SINES[i * (NODES + 2) + j] + s[i] * COSINES[i * (NODES + 2) + j];
        f2[j] = sum;
    }
    for (int j = 0; j < NODES; j++) {
        double gap = f2[j + 1] - F1[j + 1] - y, across = f2[j + 2] - f2[j], touch = gap > 0 ? 1.0 : 0.0;
        gap = gap > 0 ? gap : 0;
        force += gap, touching += touch, rise += touch * across, square += gap * gap, work += gap * across;
    }
    out[0] = force, out[1] = touching, out[2] = 0.5 * rise, out[3] = square, out[4] = 0.5 * work;
}

/* So many evaluations; their sum, so that none is left out. */
double evaluations(long count, double x, double y, double travel) {
    double total = 0, out[5];
    for (long n = 0; n < count; n++) {
        evaluate(x + 1e-9 * n, y, travel + 1e-6 * n, out);
        total += out[0];
    }
    return total;
}

/* So many steps of (11)-(17) with Newton's iteration; p: m, b_xx, b_xy, b_yy, c_xx, c_xy, c_yy, Q_x, Q_y, phi, U, h,
 * theta_1, theta_2, theta_3, k spacing, k, start of x and y at both levels, force. Returns the evaluations. */
long steps(long count, const double *p, double *state) {
    double m = p[0], h = p[11], t1 = p[12], t2 = p[13], t3 = p[14], phi = p[9], gain = 2 * t1 * h, inertia = 2 * m / h;
    double a11 = inertia + p[1] + p[4] * gain, a12 = p[2] + p[5] * gain, a22 = inertia + p[3] + p[6] * gain;
    double det = a11 * a22 - a12 * a12, d_slope = (phi * a22 - a12) / det, e_slope = (a11 - phi * a12) / det;
    double x_old = state[0], y_old = state[1], x = state[2], y = state[3], f = state[4], out[5];
    long evaluated = 0;
    for (long n = 1; n <= count; n++) {
        double x0 = t2 * x + (t3 + t1) * x_old, y0 = t2 * y + (t3 + t1) * y_old;
        double g1 = inertia * (x - x_old) / h - p[4] * x0 - p[5] * y0 - p[7];
        double g2 = inertia * (y - y_old) / h - p[6] * y0 - p[5] * x0 - p[8];
        double d = 0, e = 0;
        for (int tries = 0; tries < 100; tries++) {
            d = ((g1 + phi * f) * a22 - (g2 + f) * a12) / det;
            e = ((g2 + f) * a11 - (g1 + phi * f) * a12) / det;
            evaluate(x0 + gain * d, y0 + gain * e, p[10] * h * n, out);
            evaluated++;
            double found = p[15] * out[0], r = found - f;
            double slope = gain * (p[16] * out[2] * d_slope - p[15] * out[1] * e_slope) - 1;
            double rounding = 4e-16 * p[15] * out[1] * (fabs(y0) + fabs(gain * e));
            if (fabs(r) <= fabs(slope) * 1e-13 * fmax(f, found) + rounding)
                break;
            f = fmax(f - r / slope, 0);
        }
        double x_new = x_old + 2 * h * d, y_new = y_old + 2 * h * e;
        x_old = x, y_old = y, x = x_new, y = y_new;
    }
    state[0] = x_old, state[1] = y_old, state[2] = x, state[3] = y, state[4] = f;
    return evaluated;
}
