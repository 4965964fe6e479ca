#include "program.h"

int main(int argc, char** argv) { return mbv::RunProgram(argc, argv); }
