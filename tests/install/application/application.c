// A node on a bus that nobody else is on, for a second: status 0 when it sends the status pages that it
// promises.
#include <app/node.h>
#include <hexload_dbc.h>

enum {
    RUN_MS = 1000,
    PAGES = 1 + (RUN_MS - HEXLOAD_NODE_LISTEN_MS) /
                    HEXLOAD_NODE_STATUS_PERIOD_MS, // the first one ends the listening
};

static bool count_status_pages(void* context, const hexload_bus_frame_t* frame) {
    int* const pages = context;
    *pages += frame->id == HEXLOAD_DBC_CONTROLLER_STATUS_FRAME_ID;
    return true;
}

int main(void) {
    static hexload_node_t node;
    hexload_config_t config;
    hexload_app_settings_t settings;
    int pages = 0;
    const hexload_port_t port = {.context = &pages, .send = count_status_pages};
    hexload_config_default(&config);
    hexload_app_settings_default(&settings);
    if (hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_CLASSIC, &port) != HEXLOAD_OK) {
        return 2;
    }
    for (int ms = 0; ms < RUN_MS; ms++) {
        hexload_node_period(&node, 1);
    }
    return pages == PAGES ? 0 : 1;
}
