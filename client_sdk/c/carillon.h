// SPDX-License-Identifier: Apache-2.0
/**
 * The C interface of Carillon, for engines and for languages that load a shared library
 * (libcarillon.so): scenes, contacts of a running simulation, and offline rendering.
 *
 * Units are SI: metres, newton seconds, seconds. Points and impulses are in the frame of
 * their object or in the frame of the scene; a carillon_frame chooses. Poses are in the frame of
 * the scene. Strings are UTF-8 and end with a zero.
 *
 * Every function that returns a carillon_code returns CARILLON_OK if it succeeds. After any other
 * code, carillon_error() and carillon_error_reason() give the cause. proto/errors.md lists the
 * reasons. Results are written only on success. No function throws or ends the program. Different
 * threads may call functions of different objects at the same time. Only one thread at a time may
 * call functions of one object.
 */
#ifndef CARILLON_H_
#define CARILLON_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* NOLINTBEGIN(readability-identifier-naming): names of C, all with one prefix */

/** The result of a call: zero for success, otherwise the code of gRPC. */
typedef int32_t carillon_code;
enum {
  CARILLON_OK = 0,
  CARILLON_INVALID_ARGUMENT = 3,
  CARILLON_NOT_FOUND = 5,
  CARILLON_UNAVAILABLE = 14
};

/** Room for a name, such as "modalModels/" and 64 digits, with the zero at its end. */
#define CARILLON_NAME_SIZE 96

typedef struct carillon_client carillon_client;
typedef struct carillon_scene carillon_scene;
typedef struct carillon_stream carillon_stream;
typedef struct carillon_trace carillon_trace;

typedef struct carillon_vec3 {
  double x, y, z;
} carillon_vec3;

/** A rotation as a unit quaternion. All zeros mean no rotation. */
typedef struct carillon_quaternion {
  double w, x, y, z;
} carillon_quaternion;

/** The closed surface of a body. */
typedef struct carillon_mesh {
  const double* vertices_m; /**< three coordinates a vertex */
  size_t vertex_count;
  const uint32_t* triangles; /**< three vertices a triangle, counted from zero */
  size_t triangle_count;
} carillon_mesh;

/** An object that sounds. A zero stands for a default value, except as model or material. */
typedef struct carillon_object {
  const char* model;    /**< "modalModels/{digest}" */
  const char* material; /**< a name of the catalogue, such as "structural_steel" */
  double size;          /**< relative to the model's; zero: 1 */
  double gain;          /**< linear; zero: 1 */
  uint32_t handle;      /**< wanted in contacts; zero: the next free one */
} carillon_object;

/** The kinds of contacts. */
typedef int32_t carillon_contact_kind;
enum {
  /** As a physics engine reports it. Report it in every step while the bodies touch, even if they
   * do not move: the daemon tells impacts from resting contacts. */
  CARILLON_CONTACT_REPORTED = 0,
  CARILLON_CONTACT_IMPACT = 1, /**< a blow that the caller intends, such as that of a hammer */
  /** A contact force that rests, slides or rolls. Report it in every step until it ends. */
  CARILLON_CONTACT_FORCE = 2
};

/** A contact. Set unused members to zero. */
typedef struct carillon_contact {
  carillon_contact_kind kind;
  uint32_t object;
  carillon_vec3 point_m;
  /** On the object, friction included: of an impact, or of a reported contact over the step. */
  carillon_vec3 impulse_newton_seconds;
  carillon_vec3 force_newtons; /**< on the object, of a contact force; otherwise unused */
  uint32_t partner;  /**< any number that names the other body, the same one in each step */
  double duration_s; /**< of an impact; zero: as long as the collision of two elastic bodies */
  double travel_speed_m_per_s; /**< along a rough surface; zero: no roughness */
  double roughness_depth;      /**< relative to the force */
  carillon_vec3 normal;        /**< of the surfaces, of any length; zero: that of the impulse */
} carillon_contact;

/** The place and the rotation of an object, or of the listener, in the scene's frame. */
typedef struct carillon_pose {
  uint32_t object; /**< ignored for the listener */
  carillon_vec3 position_m;
  carillon_quaternion orientation;
} carillon_pose;

/** The frame of the points and impulses of a stream or of a trace. The daemon converts points and
 * impulses in the frame of the scene by the newest pose of their object. */
typedef int32_t carillon_frame;
enum { CARILLON_FRAME_OBJECT = 0, CARILLON_FRAME_SCENE = 1 };

/** Which effects of the objects' places are heard. A field that is not zero turns its effect on;
 * hearing.proto describes the effects. A scene without this structure sounds as if all objects were
 * at one place, and its poses only convert points and impulses. */
typedef struct carillon_hearing {
  int32_t distance_gain;       /**< quieter from afar */
  int32_t propagation_delay;   /**< later from afar, and with the Doppler effect */
  int32_t panning;             /**< on two channels, from the left or the right */
  int32_t directivity;         /**< each mode as loud as the object radiates it to the listener */
  int32_t near_field;          /**< with directivity: true near the object, too */
  int32_t binaural;            /**< for headphones, by a measured head, in place of panning */
  double reference_distance_m; /**< where distance_gain is 1, from 0.01 to 1000; zero: 1 */
  double sound_speed_m_per_s;  /**< from 10 to 10000; zero: 343 */
  carillon_pose listener;      /**< its first pose; looks along -z, x to the right, y upward */
} carillon_hearing;

/** One step of a simulation. Times do not go back within a stream or a trace. */
typedef struct carillon_step {
  double time_s;
  const carillon_contact* contacts;
  size_t contact_count;
  const carillon_pose* poses;
  size_t pose_count;
  const carillon_pose* listener; /**< its pose now; null: the listener stays */
  /** Simulation time over time of the sound since the step before, 0.001 to 1000: 0.25 in slow
   * motion, 4 in fast forward; zero: 1. Below zero the simulation pauses: the step lasts as long in
   * the sound as a step of the simulator, and its contacts are left out. */
  double time_scale;
} carillon_step;

/** The numbers of a stream's steps, and of its impulses by outcome. */
typedef struct carillon_report {
  uint64_t step_count;         /**< steps that the daemon has read */
  uint64_t accepted_count;     /**< impulses that came in time; heard if the scene lasts */
  uint64_t late_count;         /**< impulses that came late and sounded at once */
  uint64_t rejected_count;     /**< impulses that could not be used */
  uint64_t dropped_step_count; /**< steps that were not sent: the oldest of too many */
} carillon_report;

/** A scene as a program wants it, to be registered as often as needed. */
typedef struct carillon_registration {
  const char* id; /**< 1 to 64 lower-case letters, digits, ".", "_" and "-", a letter first */
  const carillon_hearing* hearing; /**< null: the scene has no places */
  const carillon_object* objects;  /**< each with a handle above zero */
  size_t object_count;
} carillon_registration;

/** How a trace is rendered. Zeros are defaults. */
typedef struct carillon_render_settings {
  uint32_t sample_rate_hz; /**< 8000 to 192000; zero: 48000 */
  uint32_t channel_count;  /**< 1 or 2; zero: 1. Panning and binaural sound need 2. */
  double tail_s; /**< after the last contact, at most 120; zero: until the sound has died away */
} carillon_render_settings;

/** Rendered sound; full scale is 1. */
typedef struct carillon_sound {
  float* samples; /**< interleaved by channel */
  uint64_t frame_count;
  uint32_t channel_count;
  uint32_t sample_rate_hz;
} carillon_sound;

/** The version of this library, such as "0.1.0". */
const char* carillon_version(void);
/** Returns the error of this thread's last failed call: the reason, a colon and a text. Returns an
 * empty text if no call of this thread has failed. The text is valid until the next call of this
 * thread fails. */
const char* carillon_error(void);
/** Returns the reason alone, such as "SERVER_UNAVAILABLE", which is stable. */
const char* carillon_error_reason(void);
/** Returns the probable mistakes in the contacts of one stream or one trace: the stream that this
 * thread has closed, or the trace that it has rendered, whichever happened later. Each line is an
 * id of proto/errors.md, such as POINTS_DISTANT, a colon and a sentence. Without a mistake the text
 * is empty. The text is valid until this thread closes a stream or renders again. */
const char* carillon_warnings(void);

/** Connects to the daemon at "unix:PATH" or "HOST:PORT", or to the default daemon if `server` is
 * null, and waits for its answer. */
carillon_code carillon_connect(const char* server, carillon_client** client);
/** Ends the connection. The caller must delete the client's scenes and close its streams before.
 * Null is ignored, as by each function that ends something. */
void carillon_disconnect(carillon_client* client);

/** Computes the model of a mesh file, unless it is stored already, and waits for it. `model` has
 * room for CARILLON_NAME_SIZE characters. */
carillon_code carillon_create_model(carillon_client* client, const char* mesh_file,
                                    const char* material, char* model);
/** Does the same for a mesh in memory. */
carillon_code carillon_create_model_of_mesh(carillon_client* client, const carillon_mesh* mesh,
                                            const char* material, char* model);

/** Makes a scene. If `hearing` is null, the scene has no places (see carillon_hearing). */
carillon_code carillon_create_scene(carillon_client* client, const carillon_hearing* hearing,
                                    carillon_scene** scene);
/** Makes a scene with an id and its objects. If the daemon has the scene already, its objects stay,
 * and the missing ones are added: a program may register its scene again after it was restarted. A
 * scene that was made with another hearing is refused (SCENE_DIFFERS). */
carillon_code carillon_register_scene(carillon_client* client,
                                      const carillon_registration* registration,
                                      carillon_scene** scene);
/** Fades out the objects of the scene and deletes it. The pointer must not be used again, which
 * holds for all that a function ends. */
void carillon_delete_scene(carillon_scene* scene);
/** Returns the name of the scene, "scenes/{id}". The text is valid until the scene is deleted. */
const char* carillon_scene_name(const carillon_scene* scene);
/** Adds an object, which can be struck as soon as the call returns. `handle` may be null. */
carillon_code carillon_add_object(carillon_scene* scene, const carillon_object* object,
                                  uint32_t* handle);
/** Fades out an object and removes it from the scene. */
carillon_code carillon_remove_object(carillon_scene* scene, uint32_t handle);
/** Lets the linear gain of the scene glide to a value of 0 to 1000. */
carillon_code carillon_set_gain(carillon_scene* scene, double gain);
/** Silences all that sounds in the scene, with a short fade. */
carillon_code carillon_stop(carillon_scene* scene);

/** Opens a stream of the contacts of a simulation whose steps last `step_s`. The stream of a
 * registered scene outlives its connection: while the daemon does not answer, steps are dropped and
 * counted, and a thread tries twice a second to register the scene again, without the objects that
 * carillon_add_object has added. */
carillon_code carillon_open_stream(carillon_scene* scene, double step_s, carillon_frame frame,
                                   carillon_stream** stream);
/** Sends a step. It copies the step and never waits for the daemon. A step whose time goes back, or
 * is over 1e10 s before or after 0, is refused with INVALID_STREAM and not sent, and the stream can
 * go on. */
carillon_code carillon_send(carillon_stream* stream, const carillon_step* step);
/** Sends the steps that wait, waits for the daemon's answer, and ends the stream. `report` may be
 * null. If the stream was opened again, the report counts its newest part only, except that it
 * counts dropped steps from the beginning. */
carillon_code carillon_close_stream(carillon_stream* stream, carillon_report* report);

/** Begins a contact trace, which is written to a file (.contacts), to be rendered now or later. The
 * steps of its simulation last `step_s`, from 1e-6 to 1 s. If `hearing` is null, the trace has no
 * places. */
carillon_code carillon_create_trace(const char* file, double step_s, carillon_frame frame,
                                    const carillon_hearing* hearing, carillon_trace** trace);
/** Adds an object, before the first step that names it. `handle` may be null. */
carillon_code carillon_trace_object(carillon_trace* trace, const carillon_object* object,
                                    uint32_t* handle);
/** Writes a step to the trace. A step whose time goes back, or is over 1e10 s before or after 0, is
 * refused with INVALID_STREAM and not written, and the trace can be continued. A trace can be
 * rendered if its times are 0 to 86400 s. */
carillon_code carillon_trace_step(carillon_trace* trace, const carillon_step* step);
/** Completes the file. */
carillon_code carillon_close_trace(carillon_trace* trace);
/** Renders a trace, faster than real time: the same samples each time. `settings` may be null.
 * carillon_free_sound frees the sound. */
carillon_code carillon_render(carillon_client* client, const char* trace_file,
                              const carillon_render_settings* settings, carillon_sound* sound);
void carillon_free_sound(carillon_sound* sound);

/* NOLINTEND(readability-identifier-naming) */

#ifdef __cplusplus
}
#endif

#endif /* CARILLON_H_ */
