#include <math.h>

double pow(double x, double y)
{
    double size;
    if (y == 0.0 || x == 1.0) {
        return 1.0;
    }
    if (isnan(x) || isnan(y) || (x < 0.0 && floor(y) != y)) {
        return (double)NAN;
    }
    size = exp(y * log(fabs(x)));
    return (x < 0.0 && floor(y / 2.0) != y / 2.0) ? -size : size;
}
