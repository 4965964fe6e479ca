#include "cli/cli.h"

int main(int argc, char** argv) { return mbv::RunCli(argc, argv); }
