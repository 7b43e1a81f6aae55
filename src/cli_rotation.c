#include "cli.h"
int tal_cli_rotation(int argc, char **argv) { (void)argc,(void)argv; return 0; }
