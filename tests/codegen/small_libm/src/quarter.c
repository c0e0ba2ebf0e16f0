#include <math.h>
#include "parts.h"

/* sine of a share of a turn, or, if odd, its cosine */
double __sin(double share, int odd)
{
    double c[TERMS / 2];
    for (int k = 0; k < TERMS / 2; k++) {
        double term = small_factorials.of[2 * k + (odd ? 0 : 1)];
        c[k] = (k % 2) ? -term : term;
    }
    return horner(c, TERMS / 2, share * share) * (odd ? 1.0 : share);
}

double small_reduced(double x, int *quadrant)
{
    double turns = nearest(x * 0x1.45f306dc9c883p-1);
    double rest = fmod(turns, 4.0);
    if (isnan(rest)) {
        *quadrant = 0;
        return rest;
    }
    *quadrant = (int)((rest < 0.0) ? rest + 4.0 : rest);
    return (x - turns * 0x1.921fb544p+0) - turns * 0x1.0b4611a626331p-34;
}
