// A plug-in built for other headers.
extern "C" __attribute__((visibility("default"))) const char* sentree_plugin_abi() { return "sentree::bt 0"; }
extern "C" __attribute__((visibility("default"))) void sentree_register_nodes(void*) { __builtin_abort(); }
