// cyclone_peer DOMAIN: a process with Cyclone DDS that speaks as nodes of rmw_cyclonedds do. It prints "ready" when
// everything of it is there. It answers on
// /from_cyclone what it hears on /to_cyclone, and how large what comes on /image is; serves /cyclone_lamp and the
// action /cyclone_count, and asks /lamp and the action /count when it hears "call", "goal" or "cancel".

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>

#include "cyclone_types.h"
#include "dds/dds.h"

#define ME UINT64_C(0x0123456789abcdef)

static dds_entity_t participant;
static dds_entity_t waitset;
static dds_entity_t said;

static void must(dds_return_t code, const char* what) {
  if (code >= 0) return;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(code));
  exit(1);
}

static dds_entity_t open_one(const char* name, const dds_topic_descriptor_t* type, bool is_writer, bool is_latched) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, is_latched ? 1 : 10);
  dds_qset_writer_data_lifecycle(qos, false);
  const dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  must(topic, name);
  const dds_entity_t made =
      is_writer ? dds_create_writer(participant, topic, qos, NULL) : dds_create_reader(participant, topic, qos, NULL);
  must(made, name);
  if (!is_writer) {
    must(dds_set_status_mask(made, DDS_DATA_AVAILABLE_STATUS), name);
    must(dds_waitset_attach(waitset, made, made), name);
  }
  dds_delete_qos(qos);
  return made;
}

static dds_entity_t reader(const char* name, const dds_topic_descriptor_t* type) {
  return open_one(name, type, false, false);
}
static dds_entity_t writer(const char* name, const dds_topic_descriptor_t* type) {
  return open_one(name, type, true, false);
}

static void say(const char* text) {
  std_msgs_msg_dds__String_ message = {.data = (char*)text};
  must(dds_write(said, &message), "from_cyclone");
}

// ---- Serving ----

struct Served {
  dds_entity_t requests;
  dds_entity_t replies;
};

static struct Served serve(const char* name, const dds_topic_descriptor_t* request,
                           const dds_topic_descriptor_t* reply) {
  char topic[128];
  struct Served made;
  snprintf(topic, sizeof topic, "rr/%sReply", name);
  made.replies = writer(topic, reply);
  snprintf(topic, sizeof topic, "rq/%sRequest", name);
  made.requests = reader(topic, request);
  return made;
}

// Until somebody hears the answers: rmw_cyclonedds waits 100 ms for the reader of who asked. On a busy machine that is
// short, and what is tested here is not its patience.
static void answer(const struct Served* served, const void* reply, const char* what) {
  dds_instance_handle_t peers[1];
  while (dds_get_matched_subscriptions(served->replies, peers, 1) == 0) dds_sleepfor(DDS_MSECS(2));
  must(dds_write(served->replies, reply), what);
}

static struct Served lamp, send_goal, get_result, cancel_goal;
static dds_entity_t feedback, status;
static demo_action_dds__Count_GetResult_Request_ awaited;  // whose goal has not ended
static bool is_awaited, finishes;
static int32_t upto;

// Of a goal that has succeeded before, too, as servers remember them.
static void tell_status(const uint8_t* goal, uint8_t how) {
  action_msgs_msg_dds__GoalStatus both[2] = {{.goal = {.sec = 3}, .status = 4}, {.goal = {.sec = 7}, .status = how}};
  memset(both[0].goal.goal, 0xee, 16);
  memcpy(both[1].goal.goal, goal, 16);
  action_msgs_msg_dds__GoalStatusArray_ all = {.status_list = {._maximum = 2, ._length = 2, ._buffer = both}};
  must(dds_write(status, &all), "status");
}

static void end_goal(uint8_t how, const char* why) {
  tell_status(awaited.goal, how);
  demo_action_dds__Count_GetResult_Response_ out = {
      .client = awaited.client, .number = awaited.number, .status = how, .reached = upto, .how = (char*)why};
  answer(&get_result, &out, "result");
  is_awaited = false;
}

static void serve_lamp(const void* sample) {
  const std_srvs_srv_dds__SetBool_Request_* in = sample;
  std_srvs_srv_dds__SetBool_Response_ out = {
      .client = in->client, .number = in->number, .success = true, .message = in->data ? "on" : "off"};
  answer(&lamp, &out, "lamp");
}
static void serve_send_goal(const void* sample) {
  const demo_action_dds__Count_SendGoal_Request_* in = sample;
  upto = in->upto;
  finishes = upto < 50;
  demo_action_dds__Count_SendGoal_Response_ out = {
      .client = in->client, .number = in->number, .accepted = upto < 100, .sec = 7};
  answer(&send_goal, &out, "send_goal");
}
static void serve_get_result(const void* sample) {
  awaited = *(const demo_action_dds__Count_GetResult_Request_*)sample;
  is_awaited = true;
  tell_status(awaited.goal, 2);
  demo_action_dds__Count_FeedbackMessage_ now = {.now = 3};
  memcpy(now.goal, awaited.goal, 16);
  must(dds_write(feedback, &now), "feedback");
  if (finishes) end_goal(4, "fine");
}
static void serve_cancel_goal(const void* sample) {
  const action_msgs_srv_dds__CancelGoal_Request_* in = sample;
  action_msgs_srv_dds__GoalInfo goal = in->goal;
  action_msgs_srv_dds__CancelGoal_Response_ out = {
      .client = in->client, .number = in->number, .goals_canceling = {._maximum = 1, ._length = 1, ._buffer = &goal}};
  answer(&cancel_goal, &out, "cancel_goal");
  if (is_awaited) end_goal(5, "stopped");
}

// ---- Asking ----

struct Asked {
  dds_entity_t requests;
  dds_entity_t replies;
  int64_t last;
};

static struct Asked ask(const char* name, const dds_topic_descriptor_t* request, const dds_topic_descriptor_t* reply) {
  char topic[128];
  struct Asked made = {.last = 0};
  snprintf(topic, sizeof topic, "rr/%sReply", name);
  made.replies = reader(topic, reply);
  snprintf(topic, sizeof topic, "rq/%sRequest", name);
  made.requests = writer(topic, request);
  return made;
}

// Until both sides of a service have found each other.
static void await(const struct Asked* asked) {
  dds_instance_handle_t peers[1];
  while (dds_get_matched_subscriptions(asked->requests, peers, 1) == 0 ||
         dds_get_matched_publications(asked->replies, peers, 1) == 0)
    dds_sleepfor(DDS_MSECS(2));
}

static struct Asked their_lamp, their_goal, their_result, their_cancel;
static const uint8_t kGoal[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

static void hear(const void* sample) {
  const char* text = ((const std_msgs_msg_dds__String_*)sample)->data;
  if (strcmp(text, "call") == 0) {
    await(&their_lamp);
    std_srvs_srv_dds__SetBool_Request_ out = {.client = ME, .number = ++their_lamp.last, .data = true};
    must(dds_write(their_lamp.requests, &out), "call");
  } else if (strcmp(text, "goal") == 0) {
    await(&their_goal);
    await(&their_result);
    demo_action_dds__Count_SendGoal_Request_ out = {.client = ME, .number = ++their_goal.last, .upto = 5};
    memcpy(out.goal, kGoal, 16);
    must(dds_write(their_goal.requests, &out), "goal");
  } else if (strcmp(text, "cancel") == 0) {
    await(&their_cancel);
    action_msgs_srv_dds__CancelGoal_Request_ out = {.client = ME, .number = ++their_cancel.last};
    memcpy(out.goal.goal, kGoal, 16);
    must(dds_write(their_cancel.requests, &out), "cancel");
  } else {
    char answer[256];
    snprintf(answer, sizeof answer, "heard %.200s", text);
    say(answer);
  }
}

static void hear_lamp(const void* sample) {
  const std_srvs_srv_dds__SetBool_Response_* in = sample;
  if (in->client != ME || in->number != their_lamp.last) return;
  char text[256];
  snprintf(text, sizeof text, "lamp %d %.200s", in->success, in->message);
  say(text);
}
static void hear_goal(const void* sample) {
  const demo_action_dds__Count_SendGoal_Response_* in = sample;
  if (in->client != ME) return;
  say(in->accepted ? "goal accepted" : "goal refused");
  demo_action_dds__Count_GetResult_Request_ out = {.client = ME, .number = ++their_result.last};
  memcpy(out.goal, kGoal, 16);
  must(dds_write(their_result.requests, &out), "get_result");
}
static void hear_result(const void* sample) {
  const demo_action_dds__Count_GetResult_Response_* in = sample;
  if (in->client != ME) return;
  char text[256];
  snprintf(text, sizeof text, "goal ended %d at %d %.200s", in->status, in->reached, in->how);
  say(text);
}
static void hear_cancel(const void* sample) {
  const action_msgs_srv_dds__CancelGoal_Response_* in = sample;
  if (in->client != ME) return;
  char text[64];
  snprintf(text, sizeof text, "cancelling %u with code %d", in->goals_canceling._length, in->return_code);
  say(text);
}
static void see_image(const void* sample) {
  char text[64];
  snprintf(text, sizeof text, "image of %u", ((const sensor_msgs_msg_dds__Octets_*)sample)->data._length);
  say(text);
}
static void hear_feedback(const void* sample) {
  char text[64];
  snprintf(text, sizeof text, "goal is at %d", ((const demo_action_dds__Count_FeedbackMessage_*)sample)->now);
  say(text);
}

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  must(participant = dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL), "participant");
  must(waitset = dds_create_waitset(participant), "waitset");
  said = writer("rt/from_cyclone", &std_msgs_msg_dds__String__desc);
  lamp = serve("cyclone_lamp", &std_srvs_srv_dds__SetBool_Request__desc, &std_srvs_srv_dds__SetBool_Response__desc);
  feedback = writer("rt/cyclone_count/_action/feedback", &demo_action_dds__Count_FeedbackMessage__desc);
  status = open_one("rt/cyclone_count/_action/status", &action_msgs_msg_dds__GoalStatusArray__desc, true, true);
  send_goal = serve("cyclone_count/_action/send_goal", &demo_action_dds__Count_SendGoal_Request__desc,
                    &demo_action_dds__Count_SendGoal_Response__desc);
  get_result = serve("cyclone_count/_action/get_result", &demo_action_dds__Count_GetResult_Request__desc,
                     &demo_action_dds__Count_GetResult_Response__desc);
  cancel_goal = serve("cyclone_count/_action/cancel_goal", &action_msgs_srv_dds__CancelGoal_Request__desc,
                      &action_msgs_srv_dds__CancelGoal_Response__desc);
  their_lamp = ask("lamp", &std_srvs_srv_dds__SetBool_Request__desc, &std_srvs_srv_dds__SetBool_Response__desc);
  their_goal = ask("count/_action/send_goal", &demo_action_dds__Count_SendGoal_Request__desc,
                   &demo_action_dds__Count_SendGoal_Response__desc);
  their_result = ask("count/_action/get_result", &demo_action_dds__Count_GetResult_Request__desc,
                     &demo_action_dds__Count_GetResult_Response__desc);
  their_cancel = ask("count/_action/cancel_goal", &action_msgs_srv_dds__CancelGoal_Request__desc,
                     &action_msgs_srv_dds__CancelGoal_Response__desc);
  const struct {
    dds_entity_t reader;
    void (*take)(const void*);
  } all[] = {{reader("rt/to_cyclone", &std_msgs_msg_dds__String__desc), hear},
             {reader("rt/image", &sensor_msgs_msg_dds__Octets__desc), see_image},
             {lamp.requests, serve_lamp},
             {send_goal.requests, serve_send_goal},
             {get_result.requests, serve_get_result},
             {cancel_goal.requests, serve_cancel_goal},
             {their_lamp.replies, hear_lamp},
             {their_goal.replies, hear_goal},
             {their_result.replies, hear_result},
             {their_cancel.replies, hear_cancel},
             {reader("rt/count/_action/feedback", &demo_action_dds__Count_FeedbackMessage__desc), hear_feedback}};
  puts("ready");
  fflush(stdout);
  for (;;) {
    must(dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY), "wait");
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i) {
      void* sample[1] = {NULL};
      dds_sample_info_t info[1];
      while (dds_take(all[i].reader, sample, info, 1, 1) == 1) {
        if (info[0].valid_data) all[i].take(sample[0]);
        must(dds_return_loan(all[i].reader, sample, 1), "loan");
      }
    }
  }
}
