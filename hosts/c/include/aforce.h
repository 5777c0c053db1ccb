// The AFORCE control law for hosts in C and C++. Generated from hosts/c/src/lib.rs: edit that.
//
// Nothing here was tried on hardware. Read docs/drive-your-own-arm.md first.
//
// SI units. Six-vectors are linear first, in the axes of the arm's base, at the tool point. Matrices are column-major, poses
// 4 x 4. Only aforce_init and aforce_drop use the heap; no function panics or throws. A host is used by one thread at a time.

#ifndef AFORCE_H
#define AFORCE_H

#include <stddef.h>
#include <stdint.h>

// The version of this header; aforce_abi_version() tells that of the library.
#define AFORCE_ABI_VERSION 1

// What a function has to say.
typedef enum AforceResult {
  // Done.
  AFORCE_RESULT_OK = 0,
  // A pointer is null, or the memory holds no host (or already one).
  AFORCE_RESULT_BAD_POINTER = 1,
  // The set-up is not allowed; the message says why.
  AFORCE_RESULT_BAD_SETUP = 2,
  // The arm's state is refused; the message says why.
  AFORCE_RESULT_REFUSED = 3,
  // The law does not act: not started, stopped, or a fault.
  AFORCE_RESULT_NOT_RUNNING = 4,
  // The action has not the length of the space, see `aforce_action_length`, or an entry is NaN.
  AFORCE_RESULT_BAD_LENGTH = 5,
  // A defect of this library. The torque, if one was asked for, is zero.
  AFORCE_RESULT_INTERNAL = 6,
} AforceResult;

// What the host is at.
typedef enum AforceStatus {
  // The law acts.
  AFORCE_STATUS_RUNNING = 0,
  // The law acts, and something of it was cut: see `limited`.
  AFORCE_STATUS_LIMITED = 1,
  // Latched: the arm holds its posture, ever more softly. Only `aforce_start` ends it.
  AFORCE_STATUS_FAULT = 2,
  // Not started, or stopped: the arm holds its posture, ever more softly.
  AFORCE_STATUS_STOPPED = 3,
} AforceStatus;

// A host in the caller's memory. Zero it before `aforce_init`; do not copy it; `aforce_drop` it in the end.
typedef struct AforceHost {
  // Not for the caller.
  uint64_t alive;
  // Not for the caller.
  uint64_t words[2048];
} AforceHost;

// What an arm's interface reports at each cycle, in its own conventions: those that the set-up's `interface` names.
typedef struct AforceState {
  // Joint positions (rad).
  double q[7];
  // Joint velocities (rad/s).
  double qd[7];
  // Pose of the tool point in the base frame: 4 x 4, column-major (m).
  double pose[16];
  // Jacobian of the tool point: 6 x 7, column-major, linear rows first, base axes.
  double jacobian[42];
  // Joint-space mass matrix: 7 x 7 (kg m^2).
  double mass[49];
  // Torques that hold the resting arm against gravity (Nm).
  double gravity[7];
  // Torques of Coriolis and centrifugal forces (Nm).
  double coriolis[7];
  // External wrench (N, Nm).
  double wrench[6];
  // The torque that the interface took last, without what the arm adds by itself (Nm).
  double tau[7];
} AforceState;

// What one cycle gives.
typedef struct AforceCommand {
  // The torque to send (Nm): finite, and within the arm's limits of torque and rate, whatever the status. Zero, which may be a
  // jump, if the function's result is not AFORCE_RESULT_OK: no host, no state, or a defect. Stop the arm by its own means then.
  double tau[7];
  // What the host is at.
  enum AforceStatus status;
  // What was cut: bit 0 a torque or its rate, 1 the wrench or its rate, 2 the error, 3 the goal, 4 a joint near its end,
  // 5 energy, 6 F_cmd after lost contact.
  uint32_t limited;
  // Why the law gave up, or 0: see `aforce_fault_text`.
  uint32_t fault;
  // Zero.
  uint32_t reserved;
} AforceCommand;

// What the controller can tell of its latest sample. Vectors of six are along and about the axes of the base.
typedef struct AforceReadings {
  // K in the space's own unit (N/m, Nm/rad; or 1/s^2). Along the contact axis the share `engagement` of it does not act.
  double stiffness[6];
  // F_ff as it acts (N, Nm).
  double feedforward[6];
  // What the task asks the tool to push with (N, Nm).
  double wrench[6];
  // e = x - x_d (m, rad).
  double error[6];
  // The set-point x_d in the base: 4 x 4, column-major (m).
  double set_point[16];
  // What the environment exerts on the tool, as the law reads it (N, Nm).
  double external[6];
  // F_d along the contact axis (N).
  double desired_force;
  // F_cmd along the contact axis (N).
  double force_command;
  // Share of the contact axis that force control has taken over.
  double engagement;
  // Level of the energy tank (J).
  double tank;
} AforceReadings;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the library: the same as AFORCE_ABI_VERSION, or the header is another's.
uint32_t aforce_abi_version(void);

// Makes a host from a set-up in TOML (docs/drive-your-own-arm.md has one). What is wrong with it is written into `message`, as
// far as its `size` bytes go, which may be none.
//
// # Safety
// `host` must be null or point to a zeroed `AforceHost`, `toml` be null or a string, `message` be null or have `size` bytes.
enum AforceResult aforce_init(struct AforceHost *host,
                              const char *toml,
                              char *message,
                              size_t size);

// Ends a host and frees what it holds. Memory without a host is left alone.
//
// # Safety
// `host` must be null or point to an `AforceHost` that is zeroed or was made by `aforce_init`.
void aforce_drop(struct AforceHost *host);

// Length of an action of the host's space; 0 without a host.
//
// # Safety
// As `aforce_drop`.
size_t aforce_action_length(const struct AforceHost *host);

// The law begins, from `state`. `model` is where the caller's own kinematics see the tool at `state->q`: 16 numbers, 4 x 4,
// column-major. Give `state->pose` where it comes from them anyway. Why a state is refused is written into `message`.
//
// # Safety
// As `aforce_init`; `state` must be null or point to what its type says, `model` be null or point to 16 numbers.
enum AforceResult aforce_start(struct AforceHost *host,
                               const struct AforceState *state,
                               const double *model,
                               char *message,
                               size_t size);

// One policy action of `length` entries in [-1, 1] (others are clipped). One with a NaN is not taken, which counts as silence.
//
// # Safety
// As `aforce_drop`; `action` must be null or point to `length` numbers.
enum AforceResult aforce_set_goal(struct AforceHost *host,
                                  const double *action,
                                  size_t length);

// One cycle: the torque for `state`, `dt` seconds after the last cycle. Neither panics nor allocates.
//
// # Safety
// As `aforce_drop`; `state` and `command` must be null or point to what their types say.
enum AforceResult aforce_update(struct AforceHost *host,
                                const struct AforceState *state,
                                double dt,
                                struct AforceCommand *command);

// The law ends; the arm holds its posture, ever more softly. A fault stays a fault.
//
// # Safety
// As `aforce_drop`.
enum AforceResult aforce_stop(struct AforceHost *host);

// 1 if the hold after a stop or a fault has come down to its lowest stiffness: the motion may end. 0 if not.
//
// # Safety
// As `aforce_drop`.
int32_t aforce_is_relaxed(const struct AforceHost *host);

// What the controller can tell of its latest sample.
//
// # Safety
// As `aforce_drop`; `readings` must be null or point to what its type says.
enum AforceResult aforce_read(const struct AforceHost *host, struct AforceReadings *readings);

// What a result means, in English.
const char *aforce_result_text(uint32_t result);

// What a fault's code means, in English.
const char *aforce_fault_text(uint32_t fault);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* AFORCE_H */
