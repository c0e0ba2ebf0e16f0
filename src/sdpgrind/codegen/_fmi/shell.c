/* Types of FMI 2.0, fmi-standard.org: 2.1.2 and 2.1.4 to 2.1.5 of the specification. */

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...);
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(fmi2ComponentEnvironment environment, fmi2Status status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

/* Where several FMUs are linked into one program, their sources are compiled with a prefix each. */
#ifdef FMI2_FUNCTION_PREFIX
#define FMI_PASTED(prefix, name) prefix ## name
#define FMI_NAMED(prefix, name) FMI_PASTED(prefix, name)
#define FMI(name) FMI_NAMED(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI(name) name
#endif

#if defined(_WIN32)
#define FMI_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI_EXPORT __attribute__((visibility("default")))
#else
#define FMI_EXPORT
#endif

/* An instance. All that changes is in unit_values, which holds doubles alone: a state is a copy of it. */

enum { CREATED, INITIALIZING, STEPPING, TERMINATED };

typedef struct {
    double mode;
    double time; /* s: end of the last step */
    double status; /* result of the last step */
    double valid[INPUTS]; /* 0: no reading */
    double inputs[INPUTS];
    double outputs[OUTPUTS];
    unit_state state;
} unit_values;

typedef struct {
    unit_values now;
    const fmi2CallbackFunctions *functions;
    char name[];
} unit;

/* compilation stops here unless input and output are rows of doubles */
typedef char inputs_are_doubles[(sizeof(unit_input) == (INPUTS * sizeof(double))) ? 1 : -1];
typedef char outputs_are_doubles[(sizeof(unit_output) == (OUTPUTS * sizeof(double))) ? 1 : -1];

#define MESSAGE 256
#define FINGERPRINT_SIZE (sizeof(UNIT_FINGERPRINT) - 1U)
/* masters add up their times: rounding of the time after 1e9 steps is 2.2e-7 of a step */
#define ROUNDING 1e-6

static fmi2Status refused(const unit *self, const char *text)
{
    const fmi2CallbackFunctions *functions = self->functions;
    if (functions->logger != NULL) {
        functions->logger(functions->componentEnvironment, self->name, fmi2Error, "logStatusError", text);
    }
    return fmi2Error;
}

static fmi2Status refused_reference(const unit *self, fmi2ValueReference reference, const char *what)
{
    char text[MESSAGE];
    (void)snprintf(text, sizeof text, "value reference must be that of %s; got %u", what, reference);
    return refused(self, text);
}

static fmi2Status refused_number(const unit *self, const char *rule, double number)
{
    char text[MESSAGE];
    (void)snprintf(text, sizeof text, "%s; got %.17g s", rule, number);
    return refused(self, text);
}

static void start_anew(unit *self)
{
    int k;
    (void)memset(&self->now, 0, sizeof self->now);
    for (k = 0; k < INPUTS; k++) {
        self->now.valid[k] = 1.0;
        self->now.inputs[k] = first_inputs[k];
    }
    UNIT_RESET(&self->now.state);
}

static fmi2Status moved_on(unit *self, int from, int to, const char *rule)
{
    if (self->now.mode != (double)from) {
        return refused(self, rule);
    }
    self->now.mode = (double)to;
    return fmi2OK;
}

/* Place of a reference among `count` from `first` on, or -1. */
static int place_of(fmi2ValueReference reference, unsigned first, unsigned count)
{
    return ((reference >= first) && ((reference - first) < count)) ? (int)(reference - first) : -1;
}

static int flag_of(fmi2ValueReference reference)
{
    int place = place_of(reference, FIRST_FLAG, INPUTS);
    return ((place >= 0) && (may_be_missing[place] != 0)) ? place : -1;
}

static int fits(double number, double wanted)
{
    return (fabs(number - wanted) <= (ROUNDING * PERIOD)) ? 1 : 0;
}

static fmi2Status step_refused(const unit *self, double point, double length)
{
    if (self->now.mode != (double)STEPPING) {
        return refused(self, "fmi2DoStep must come after fmi2ExitInitializationMode, before fmi2Terminate");
    }
    if (PERIOD <= 0.0) {
        if ((isfinite(length) == 0) || (length < 0.0)) {
            return refused_number(self, "communicationStepSize must be finite and >= 0", length);
        }
        return fmi2OK;
    }
    if (fits(length, PERIOD) == 0) {
        return refused_number(self, "communicationStepSize must be the period, " PERIOD_TEXT " s", length);
    }
    if (fits(point, self->now.time) == 0) {
        return refused_number(self, "currentCommunicationPoint must be the end of the step before", point);
    }
    return fmi2OK;
}

static fmi2Status status_refused(const unit *self, int32_t status)
{
    switch (status) {
    case -1:
        return refused(self, "inputs must be as their meanings say, finite and within their range;"
                             " the state has not changed");
    case -2:
        return refused(self, "a loop has reached its bound; the state has not changed");
    default:
        return refused(self, "a number was no index; the state has not changed");
    }
}

static fmi2Status advance(unit *self, double point, double length)
{
    double given[INPUTS];
    unit_input in;
    unit_output out;
    int32_t status;
    int k;
    if (step_refused(self, point, length) != fmi2OK) {
        return fmi2Error;
    }
    for (k = 0; k < INPUTS; k++) {
        given[k] = (self->now.valid[k] != 0.0) ? self->now.inputs[k] : (double)NAN;
    }
    (void)memcpy(&in, given, sizeof in);
    (void)memset(&out, 0, sizeof out);
    status = UNIT_STEP(&self->now.state, &in, &out);
    if (status < 0) {
        return status_refused(self, status);
    }
    (void)memcpy(self->now.outputs, &out, sizeof out);
    self->now.status = (double)status;
    self->now.time = point + length;
    return fmi2OK;
}

/* Functions of the standard that are common to both kinds of FMUs. */

FMI_EXPORT const char *FMI(fmi2GetTypesPlatform)(void)
{
    return "default";
}

FMI_EXPORT const char *FMI(fmi2GetVersion)(void)
{
    return "2.0";
}

FMI_EXPORT fmi2Status FMI(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count,
                                               const fmi2String categories[])
{
    (void)c;
    (void)on;
    (void)count;
    (void)categories;
    return fmi2OK;
}

FMI_EXPORT fmi2Component FMI(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                              fmi2String resources, const fmi2CallbackFunctions *functions,
                                              fmi2Boolean visible, fmi2Boolean logging)
{
    unit *self;
    size_t length;
    (void)resources;
    (void)visible;
    (void)logging;
    if ((name == NULL) || (guid == NULL) || (functions == NULL)) {
        return NULL;
    }
    length = strlen(name) + 1U;
    self = calloc(1U, sizeof(unit) + length);
    if (self == NULL) {
        return NULL;
    }
    (void)memcpy(self->name, name, length);
    self->functions = functions;
    if (type != fmi2CoSimulation) {
        (void)refused(self, "fmuType must be fmi2CoSimulation");
    } else if (strcmp(guid, UNIT_GUID) != 0) {
        (void)refused(self, "fmuGUID must be " UNIT_GUID ", that of modelDescription.xml");
    } else {
        start_anew(self);
        return self;
    }
    free(self);
    return NULL;
}

FMI_EXPORT void FMI(fmi2FreeInstance)(fmi2Component c)
{
    free(c);
}

FMI_EXPORT fmi2Status FMI(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean with_tolerance,
                                               fmi2Real tolerance, fmi2Real start, fmi2Boolean with_stop,
                                               fmi2Real stop)
{
    unit *self = c;
    (void)with_tolerance;
    (void)tolerance;
    (void)with_stop;
    (void)stop;
    if (self->now.mode != (double)CREATED) {
        return refused(self, "fmi2SetupExperiment must come before fmi2EnterInitializationMode");
    }
    self->now.time = start;
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2EnterInitializationMode)(fmi2Component c)
{
    return moved_on(c, CREATED, INITIALIZING,
                    "fmi2EnterInitializationMode must come once, or after fmi2Reset");
}

FMI_EXPORT fmi2Status FMI(fmi2ExitInitializationMode)(fmi2Component c)
{
    return moved_on(c, INITIALIZING, STEPPING,
                    "fmi2ExitInitializationMode must come after fmi2EnterInitializationMode");
}

FMI_EXPORT fmi2Status FMI(fmi2Terminate)(fmi2Component c)
{
    return moved_on(c, STEPPING, TERMINATED, "fmi2Terminate must come after fmi2ExitInitializationMode");
}

FMI_EXPORT fmi2Status FMI(fmi2Reset)(fmi2Component c)
{
    start_anew(c);
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2GetReal)(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                       fmi2Real values[])
{
    const unit *self = c;
    size_t k;
    for (k = 0U; k < count; k++) {
        int input = place_of(references[k], 0U, INPUTS);
        int output = place_of(references[k], INPUTS, OUTPUTS);
        if ((input < 0) && (output < 0)) {
            return refused_reference(self, references[k], "a Real");
        }
        values[k] = (input >= 0) ? self->now.inputs[input] : self->now.outputs[output];
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2GetInteger)(fmi2Component c, const fmi2ValueReference references[],
                                          size_t count, fmi2Integer values[])
{
    const unit *self = c;
    size_t k;
    for (k = 0U; k < count; k++) {
        if (references[k] != STATUS_REFERENCE) {
            return refused_reference(self, references[k], "the status");
        }
        values[k] = (fmi2Integer)self->now.status;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2GetBoolean)(fmi2Component c, const fmi2ValueReference references[],
                                          size_t count, fmi2Boolean values[])
{
    const unit *self = c;
    size_t k;
    for (k = 0U; k < count; k++) {
        int place = flag_of(references[k]);
        if (place < 0) {
            return refused_reference(self, references[k], "a Boolean");
        }
        values[k] = (self->now.valid[place] != 0.0) ? 1 : 0;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2GetString)(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                         fmi2String values[])
{
    (void)values;
    return (count == 0U) ? fmi2OK : refused_reference(c, references[0], "a String: there is none");
}

FMI_EXPORT fmi2Status FMI(fmi2SetReal)(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                       const fmi2Real values[])
{
    unit *self = c;
    size_t k;
    for (k = 0U; k < count; k++) {
        int input = place_of(references[k], 0U, INPUTS);
        if (input < 0) {
            return refused_reference(self, references[k], "a Real input");
        }
        self->now.inputs[input] = values[k];
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2SetInteger)(fmi2Component c, const fmi2ValueReference references[],
                                          size_t count, const fmi2Integer values[])
{
    (void)values;
    return (count == 0U) ? fmi2OK : refused_reference(c, references[0], "an Integer input: there is none");
}

FMI_EXPORT fmi2Status FMI(fmi2SetBoolean)(fmi2Component c, const fmi2ValueReference references[],
                                          size_t count, const fmi2Boolean values[])
{
    unit *self = c;
    size_t k;
    for (k = 0U; k < count; k++) {
        int place = flag_of(references[k]);
        if (place < 0) {
            return refused_reference(self, references[k], "a Boolean input");
        }
        self->now.valid[place] = (values[k] != 0) ? 1.0 : 0.0;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2SetString)(fmi2Component c, const fmi2ValueReference references[], size_t count,
                                         const fmi2String values[])
{
    (void)values;
    return (count == 0U) ? fmi2OK : refused_reference(c, references[0], "a String: there is none");
}

/* States: copies of unit_values; as bytes they follow the fingerprint of the law. */

FMI_EXPORT fmi2Status FMI(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    const unit *self = c;
    if (*state == NULL) {
        *state = calloc(1U, sizeof self->now);
    }
    if (*state == NULL) {
        return refused(self, "no memory is left for a state");
    }
    (void)memcpy(*state, &self->now, sizeof self->now);
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
    unit *self = c;
    if (state == NULL) {
        return refused(self, "FMUstate must be a state that was stored");
    }
    (void)memcpy(&self->now, state, sizeof self->now);
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    *size = FINGERPRINT_SIZE + sizeof(unit_values);
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                                 size_t size)
{
    if ((state == NULL) || (size < (FINGERPRINT_SIZE + sizeof(unit_values)))) {
        return refused(c, "size must be that of fmi2SerializedFMUstateSize");
    }
    (void)memcpy(bytes, UNIT_FINGERPRINT, FINGERPRINT_SIZE);
    (void)memcpy(&bytes[FINGERPRINT_SIZE], state, sizeof(unit_values));
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                                   fmi2FMUstate *state)
{
    const unit *self = c;
    if ((size != (FINGERPRINT_SIZE + sizeof(unit_values))) ||
        (memcmp(bytes, UNIT_FINGERPRINT, FINGERPRINT_SIZE) != 0)) {
        return refused(self, "serializedState must be a state of this FMU, fingerprint " UNIT_FINGERPRINT);
    }
    if (*state == NULL) {
        *state = calloc(1U, sizeof(unit_values));
    }
    if (*state == NULL) {
        return refused(self, "no memory is left for a state");
    }
    (void)memcpy(*state, &bytes[FINGERPRINT_SIZE], sizeof(unit_values));
    return fmi2OK;
}

FMI_EXPORT fmi2Status FMI(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[],
                                                        size_t unknown, const fmi2ValueReference knowns[],
                                                        size_t known, const fmi2Real known_rates[],
                                                        fmi2Real unknown_rates[])
{
    (void)unknowns;
    (void)unknown;
    (void)knowns;
    (void)known;
    (void)known_rates;
    (void)unknown_rates;
    return refused(c, "this FMU has no directional derivatives");
}

/* Functions of the standard for co-simulation. */

FMI_EXPORT fmi2Status FMI(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference references[],
                                                       size_t count, const fmi2Integer orders[],
                                                       const fmi2Real values[])
{
    (void)references;
    (void)orders;
    (void)values;
    return (count == 0U) ? fmi2OK : refused(c, "inputs are discrete: they have no derivatives");
}

FMI_EXPORT fmi2Status FMI(fmi2GetRealOutputDerivatives)(fmi2Component c,
                                                        const fmi2ValueReference references[], size_t count,
                                                        const fmi2Integer orders[], fmi2Real values[])
{
    (void)references;
    (void)orders;
    (void)values;
    return (count == 0U) ? fmi2OK : refused(c, "outputs are discrete: they have no derivatives");
}

FMI_EXPORT fmi2Status FMI(fmi2DoStep)(fmi2Component c, fmi2Real point, fmi2Real length, fmi2Boolean no_return)
{
    (void)no_return;
    return advance(c, point, length);
}

FMI_EXPORT fmi2Status FMI(fmi2CancelStep)(fmi2Component c)
{
    return refused(c, "steps are not asynchronous: there is none to cancel");
}

FMI_EXPORT fmi2Status FMI(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c;
    *value = fmi2OK;
    return (kind == fmi2DoStepStatus) ? fmi2OK : fmi2Discard;
}

FMI_EXPORT fmi2Status FMI(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const unit *self = c;
    *value = self->now.time;
    return (kind == fmi2LastSuccessfulTime) ? fmi2OK : fmi2Discard;
}

FMI_EXPORT fmi2Status FMI(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind,
                                                fmi2Integer *value)
{
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

FMI_EXPORT fmi2Status FMI(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind,
                                                fmi2Boolean *value)
{
    (void)c;
    *value = 0;
    return (kind == fmi2Terminated) ? fmi2OK : fmi2Discard;
}

FMI_EXPORT fmi2Status FMI(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    *value = "";
    return fmi2Discard;
}
