#include <math.h>
#include "parts.h"

static const double LN2 = 0x1.62e42fefa39efp-1;

double log(double x)
{
    int k;
    double m;
    double s;
    double sum = 0.0;
    if (isnan(x) || isinf(x) || x <= 0.0) {
        return (x > 0.0) ? x : (x == 0.0) ? -(double)INFINITY : (double)NAN;
    }
    m = frexp(x, &k);
    if (m < 0x1.6a09e667f3bcdp-1) {
        m *= 2.0;
        k -= 1;
    }
    s = (m - 1.0) / (m + 1.0);
    for (int n = 21; n > 0; n -= 2) {
        sum = sum * (s * s) + 2.0 / n;
    }
#ifdef __FP_FAST_FMA
    return fma(s, sum, k * LN2); /* other bits, where this is fast */
#else
    return s * sum + k * LN2;
#endif
}
