#include <math.h>
#include "parts.h"

/* not seen from outside, though another file has one of this name */
static const double LN2[2] = {0x1.62e42fefa38p-1, 0x1.ef35793c7673p-45};

double exp(double x)
{
    double k;
    double r;
    if (isnan(x) || x > 710.0 || x < -746.0) {
        return isnan(x) ? x : (x > 0.0) ? (double)INFINITY : 0.0;
    }
    k = nearest(x * 0x1.71547652b82fep+0);
    r = (x - k * LN2[0]) - k * LN2[1];
    return ldexp(horner(small_factorials.of, TERMS, r), (int)k);
}
