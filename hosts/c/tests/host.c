// A host in C: refusals, the golden vectors of the law, a fault. Usage: `host GOLDEN_FOLDER`; exits with 0 if every check passes.

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "aforce.h"

#define CHECK(condition)                                                                \
    do {                                                                                \
        if (!(condition)) {                                                             \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);             \
            exit(1);                                                                    \
        }                                                                               \
    } while (0)

enum { SAMPLES = 40, COLUMNS = 1 + 7 + 7 + 3 + 4 + 6 + 42 + 49 + 7 + 6, ENTRIES = 13 };

// The settings of the golden vectors: their torque limits (not quite a Panda's), and no other bound on the law.
static const char *const SETUP =
    "interface = 'plain'\n"
    "space = '%s'\n"
    "[arm]\n"
    "range = [[-10, 10], [-10, 10], [-10, 10], [-10, 10], [-10, 10], [-10, 10], [-10, 10]]\n"
    "speed_max = [1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3]\n"
    "torque_max = [80, 80, 80, 80, 80, 12, 12]\n"
    "torque_rate_max = [1e9, 1e9, 1e9, 1e9, 1e9, 1e9, 1e9]\n"
    "rotor_inertia = [0, 0, 0, 0, 0, 0, 0]\n"
    "cartesian = { translation = [17, 13, 6500], rotation = [25, 25, 12500] }\n"
    "[limits]\n"
    "silence_max = inf\n"
    "error_max = [inf, inf]\n"
    "wrench_max = [inf, inf]\n"
    "wrench_rate_max = [inf, inf]\n"
    "external_max = [inf, inf]\n"
    "workspace = [[-inf, -inf, -inf], [inf, inf, inf]]\n"
    "joint_margin = 0\n"
    "contact_loss = inf\n"
    "disagreement_max = %s\n"
    "tank = { initial = inf, capacity = inf, low = 0 }\n"
    "[controller]\n"
    "control_hz = 500\n"
    "position_step = 0.05\n"
    "rotation_step = 0.5\n"
    "interpolation.linear.ramp_ratio = 1\n"
    "force = { ki = 4, force_max = 50 }\n";

static AforceHost host; // Zeroed, as aforce_init requires.
static char message[256];

// `disagreement`: "1", or "inf" to switch off the comparison of a state's fields with each other.
static int init(const char *space, const char *disagreement) {
    char setup[2048];
    snprintf(setup, sizeof setup, SETUP, space, disagreement);
    return (int)aforce_init(&host, setup, message, sizeof message);
}

// Reads a table of numbers below a header; text in the first cell counts as 0.
static int read_table(const char *folder, const char *name, int columns, double *to, int rows) {
    char path[4096];
    static char line[1 << 16];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        exit(1);
    }
    CHECK(fgets(line, sizeof line, file));
    int row = 0;
    for (; row < rows && fgets(line, sizeof line, file); row++) {
        char *cell = line;
        for (int column = 0; column < columns; column++) {
            to[row * columns + column] = strtod(cell, NULL);
            cell += strcspn(cell, ",\n");
            cell += *cell == ',';
        }
    }
    fclose(file);
    return row;
}

// A row of measurements.csv as a state. Matrices are row-major in the file and column-major in the state.
static AforceState state_of(const double *row) {
    AforceState state;
    memset(&state, 0, sizeof state);
    const double *at = row + 1;
    memcpy(state.q, at, sizeof state.q);
    memcpy(state.qd, at + 7, sizeof state.qd);
    const double *p = at + 14, x = at[17], y = at[18], z = at[19], w = at[20];
    const double rotation[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y), // First column.
        2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
        2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y),
    };
    for (int column = 0; column < 3; column++)
        memcpy(state.pose + 4 * column, rotation + 3 * column, 3 * sizeof(double));
    memcpy(state.pose + 12, p, 3 * sizeof(double));
    state.pose[15] = 1;
    const double *jacobian = at + 27, *mass = jacobian + 42, *bias = mass + 49;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 7; c++) state.jacobian[r + 6 * c] = jacobian[7 * r + c];
    for (int r = 0; r < 7; r++)
        for (int c = 0; c < 7; c++) state.mass[r + 7 * c] = mass[7 * r + c];
    memcpy(state.gravity, bias, sizeof state.gravity); // The bias includes Coriolis torques.
    memcpy(state.wrench, bias + 7, sizeof state.wrench);
    memcpy(state.tau, bias, sizeof state.tau);
    return state;
}

static void check_refusals(const AforceState *first) {
    AforceCommand command;
    CHECK(aforce_abi_version() == AFORCE_ABI_VERSION);
    memset(&command, 0xff, sizeof command);
    CHECK(aforce_update(&host, first, 0.002, &command) == AFORCE_RESULT_BAD_POINTER);
    CHECK(command.status == AFORCE_STATUS_STOPPED && command.tau[6] == 0 && command.reserved == 0);
    CHECK(aforce_update(&host, first, 0.002, NULL) == AFORCE_RESULT_BAD_POINTER);
    CHECK(aforce_read(&host, NULL) == AFORCE_RESULT_BAD_POINTER);
    CHECK(aforce_stop(NULL) == AFORCE_RESULT_BAD_POINTER);
    CHECK(init("aforse", "1") == AFORCE_RESULT_BAD_SETUP);
    CHECK(strstr(message, "did you mean `aforce`?"));
    CHECK(aforce_init(&host, "x", message, 6) == AFORCE_RESULT_BAD_SETUP && strlen(message) == 5);
    CHECK(aforce_init(&host, "x", NULL, 0) == AFORCE_RESULT_BAD_SETUP);

    CHECK(init("low", "1") == AFORCE_RESULT_OK);
    CHECK(init("low", "1") == AFORCE_RESULT_BAD_POINTER); // The memory already holds a host.
    const double action[6] = {0};
    CHECK(aforce_action_length(&host) == 6);
    CHECK(aforce_set_goal(&host, action, 6) == AFORCE_RESULT_NOT_RUNNING);
    double model[16];
    memcpy(model, first->pose, sizeof model);
    model[14] += 0.107;
    CHECK(aforce_start(&host, first, model, message, sizeof message) == AFORCE_RESULT_REFUSED);
    CHECK(strstr(message, "0.1070 m"));
    AforceState turned = *first;
    turned.pose[0] = 3; // Not a rotation.
    CHECK(aforce_start(&host, &turned, turned.pose, message, sizeof message) == AFORCE_RESULT_REFUSED);
    // Fields left at zero, at the start and while the law runs.
    AforceState empty[2] = {*first, *first};
    memset(empty[0].mass, 0, sizeof empty[0].mass);
    memset(empty[1].jacobian, 0, sizeof empty[1].jacobian);
    const char *const told[2] = {"joint 1 an inertia of 0", "the axis of a joint has length 1"};
    for (int i = 0; i < 2; i++) {
        CHECK(aforce_start(&host, &empty[i], empty[i].pose, message, sizeof message) == AFORCE_RESULT_REFUSED);
        CHECK(strstr(message, told[i]));
        CHECK(aforce_start(&host, first, first->pose, message, sizeof message) == AFORCE_RESULT_OK);
        CHECK(aforce_update(&host, &empty[i], 0.002, &command) == AFORCE_RESULT_OK);
        CHECK(command.status == AFORCE_STATUS_FAULT && command.fault == (uint32_t)(12 + i));
    }
    CHECK(aforce_start(&host, first, first->pose, message, sizeof message) == AFORCE_RESULT_OK);
    CHECK(aforce_set_goal(&host, action, 7) == AFORCE_RESULT_BAD_LENGTH);
    const double unknown[6] = {0, 0, NAN, 0, 0, 0};
    CHECK(aforce_set_goal(&host, unknown, 6) == AFORCE_RESULT_BAD_LENGTH);
    CHECK(aforce_set_goal(&host, action, 6) == AFORCE_RESULT_OK);

    // A fault latches, and the torque stays finite.
    AforceState broken = *first;
    broken.mass[3] = NAN;
    CHECK(aforce_update(&host, &broken, 0.002, &command) == AFORCE_RESULT_OK);
    CHECK(command.status == AFORCE_STATUS_FAULT && command.fault == 1);
    CHECK(aforce_update(&host, first, 0.002, &command) == AFORCE_RESULT_OK);
    CHECK(command.status == AFORCE_STATUS_FAULT && command.fault == 1);
    for (int joint = 0; joint < 7; joint++) CHECK(isfinite(command.tau[joint]));
    CHECK(!aforce_is_relaxed(&host));
    for (int cycle = 0; cycle < 600; cycle++) aforce_update(&host, first, 0.002, &command);
    CHECK(aforce_is_relaxed(&host));
    CHECK(strlen(aforce_fault_text(command.fault)) > 10 && strcmp(aforce_fault_text(99), "no such fault") == 0);
    CHECK(strcmp(aforce_result_text(AFORCE_RESULT_OK), "done") == 0);
    aforce_drop(&host);
    aforce_drop(&host);
    aforce_drop(NULL);
    CHECK(aforce_action_length(&host) == 0);
}

int main(int argc, char **argv) {
    CHECK(argc == 2);
    static double measurements[SAMPLES][COLUMNS], actions[8][ENTRIES + 1];
    CHECK(read_table(argv[1], "measurements.csv", COLUMNS, &measurements[0][0], SAMPLES) == SAMPLES);
    int goals = read_table(argv[1], "actions.csv", ENTRIES + 1, &actions[0][0], 8);
    AforceState first = state_of(measurements[0]);
    check_refusals(&first);

    // Every space of the record except those that a host refuses: `aforce-shaped`, whose K winds up, and robosuite's, whose set-points jump.
    char path[4096], line[4096];
    snprintf(path, sizeof path, "%s/torques.csv", argv[1]);
    FILE *file = fopen(path, "r");
    CHECK(file && fgets(line, sizeof line, file));
    double worst_torque = 0, worst_stiffness = 0;
    int spaces = 0, rows = 0;
    bool taken = false;
    while (fgets(line, sizeof line, file)) {
        char *rest = strchr(line, ',');
        CHECK(rest);
        *rest++ = 0;
        int sample = (int)strtol(rest, &rest, 10);
        AforceState state = state_of(measurements[sample]);
        if (sample == 0) {
            aforce_drop(&host);
            taken = strncmp(line, "aforce-shaped", 13) != 0 && strncmp(line, "robosuite", 9) != 0;
            CHECK(init(line, "inf") == (taken ? AFORCE_RESULT_OK : AFORCE_RESULT_BAD_SETUP));
            if (taken) CHECK(aforce_start(&host, &state, state.pose, message, sizeof message) == AFORCE_RESULT_OK);
            spaces += taken;
        }
        if (!taken) continue;
        for (int goal = 0; goal < goals; goal++)
            if ((int)actions[goal][0] == sample) {
                // The host counts an action from the previous measurement, the record from the present one. An update
                // with dt = 0 makes the present measurement the previous one.
                AforceCommand command;
                CHECK(aforce_update(&host, &state, 0, &command) == AFORCE_RESULT_OK);
                CHECK(aforce_set_goal(&host, actions[goal] + 1, aforce_action_length(&host)) == AFORCE_RESULT_OK);
            }
        AforceCommand command;
        CHECK(aforce_update(&host, &state, 0.002, &command) == AFORCE_RESULT_OK);
        CHECK(command.status == AFORCE_STATUS_RUNNING || command.limited == 1);
        AforceReadings readings;
        CHECK(aforce_read(&host, &readings) == AFORCE_RESULT_OK);
        for (int joint = 0; joint < 7; joint++)
            worst_torque = fmax(worst_torque, fabs(command.tau[joint] - strtod(rest + 1, &rest)));
        for (int axis = 0; axis < 6; axis++)
            worst_stiffness = fmax(worst_stiffness, fabs(readings.stiffness[axis] - strtod(rest + 1, &rest)));
        rows++;
    }
    fclose(file);
    aforce_drop(&host);
    printf("%d spaces, %d samples: torques within %.1e Nm, K within %.1e of the record\n", spaces, rows, worst_torque,
           worst_stiffness);
    CHECK(spaces >= 14 && rows == SAMPLES * spaces);
    // The tolerance allows for the record's twist, which is rounded to ten decimals; the host's twist is jacobian x qd.
    CHECK(worst_torque < 1e-5 && worst_stiffness < 1e-5);
    return 0;
}
