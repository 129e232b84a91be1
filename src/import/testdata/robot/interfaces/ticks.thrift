enum SkillAck { SKILL_IDLE, SKILL_RUNNING, SKILL_SUCCESS, SKILL_FAILURE }
service SkillRequest { SkillAck request_ack(); void send_start(); void send_stop(); }
