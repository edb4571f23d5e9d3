/* The pacer in C: sleeps on an absolute grid and prints how late each wake-up was [ns].
 *
 * Usage: pacer_reference PERIOD_NS TICKS
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static long long now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: %s PERIOD_NS TICKS\n", argv[0]);
        return 2;
    }
    const long long period_ns = atoll(argv[1]);
    const long ticks = atol(argv[2]);
    long long *late_ns = calloc(ticks, sizeof *late_ns);
    if (period_ns <= 0 || ticks <= 0 || late_ns == NULL)
        return 2;
    const long long start_ns = now_ns();
    for (long tick = 0; tick < ticks; tick++) {
        const long long due_ns = start_ns + (tick + 1) * period_ns;
        const struct timespec due = {due_ns / 1000000000LL, due_ns % 1000000000LL};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) == EINTR) {
        }
        late_ns[tick] = now_ns() - due_ns;
    }
    for (long tick = 0; tick < ticks; tick++)
        printf("%lld\n", late_ns[tick]);
    free(late_ns);
    return 0;
}
