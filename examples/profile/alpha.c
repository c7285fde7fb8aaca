/* Alpha of a profile.json in C: cc alpha.c -o alpha -lm && ./alpha profile.json < angles */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST 5000

/* Numbers of a list, or of a list of lists, of the nodes; null becomes NaN. */
static int numbers(const char *nodes, const char *key, double *to)
{
    const char *p = strstr(nodes, key) + strlen(key);
    int n = 0, depth = 0;
    for (; n < MOST && !(depth == 1 && *p == ']'); p++) {
        char *end;
        if (*p == '[') depth++;
        if (*p == ']') depth--;
        if (*p == 'n') to[n++] = NAN, p += 3;
        if (*p == '-' || (*p >= '0' && *p <= '9')) to[n++] = strtod(p, &end), p = end - 1;
    }
    return n;
}

static double rows[MOST], columns[MOST], alpha_z[MOST], alpha_x[MOST];
static int n_rows, n_columns;

/* One component, N/cm^3, at angles in degrees. */
static double alpha(const double *table, double beta, double gamma)
{
    int i = 0, j = 0;
    beta -= 180 * floor((beta + 90) / 180);
    gamma -= 360 * floor((gamma + 180) / 360);
    while (i < n_rows - 2 && rows[i + 1] <= beta) i++;
    while (j < n_columns - 2 && columns[j + 1] <= gamma) j++;
    double u = (beta - rows[i]) / (rows[i + 1] - rows[i]);
    double v = (gamma - columns[j]) / (columns[j + 1] - columns[j]), sum = 0;
    for (int k = 0; k < 2; k++)
        for (int m = 0; m < 2; m++) {
            double weight = (k ? u : 1 - u) * (m ? v : 1 - v);
            if (weight > 1e-9) sum += weight * table[(i + k) * n_columns + j + m];
        }
    return sum;
}

int main(int count, char **words)
{
    static char text[8000001];
    FILE *file = count == 2 ? fopen(words[1], "rb") : NULL;
    const char *nodes = file && fread(text, 1, sizeof text - 1, file) ? strstr(text, "\"nodes\":") : NULL;
    if (!nodes) return fprintf(stderr, "usage: alpha profile.json < angles\n"), 1;
    n_rows = numbers(nodes, "\"beta_deg\":", rows);
    n_columns = numbers(nodes, "\"gamma_deg\":", columns);
    numbers(nodes, "\"alpha_z_N_per_cm3\":", alpha_z);
    numbers(nodes, "\"alpha_x_N_per_cm3\":", alpha_x);
    for (double beta, gamma; scanf("%lf %lf", &beta, &gamma) == 2;)
        printf("%.17g %.17g\n", alpha(alpha_z, beta, gamma), alpha(alpha_x, beta, gamma));
    return 0;
}
