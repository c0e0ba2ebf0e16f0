#include <math.h>
#include "parts.h"

double sin(double x)
{
    int quadrant;
    double r = small_reduced(x, &quadrant);
    double found = __sin(r, quadrant % 2);
    return (quadrant > 1) ? -found : found;
}
