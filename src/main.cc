#include "cli/run_cli.h"

int main(int argc, char** argv) { return mbv::RunCli(argc, argv); }
