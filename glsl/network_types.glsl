// Structures of thermal networks shared with Rust: their twins stand in src/gpu/layout.rs.

// A node of a network.
struct NetworkNode {
    // 1 / C [K/J]; 0 of a node that stores no heat.
    float inverse_capacitance;
    // C [J/K].
    float capacitance;
    // Stefan-Boltzmann constant x emissivity x area to space [W/K4].
    float emission;
    // Sum of GL [W/K].
    float conductance_sum;
    // Stefan-Boltzmann constant x (sum of GR + emissivity x area) [W/K4].
    float emission_sum;
    // Its links: the first, and the one after the last.
    uint links_begin;
    uint links_end;
};

// What a node exchanges with one neighbour.
struct NetworkLink {
    uint neighbour;
    // GL [W/K].
    float conductance;
    // Stefan-Boltzmann constant x GR [W/K4].
    float exchange;
};

// One stage of RKL2: change = mu x last + nu x last but one + mu_step x rate + gamma_step x rate at the start.
struct NetworkStage {
    float mu;
    float nu;
    // [s]
    float mu_step;
    // [s]
    float gamma_step;
    // Time of the stage [s] since the sub-step's start.
    float time;
};

// What one dispatch of the fused kernels does.
struct NetworkAttempt {
    uint nodes;
    // Sub-steps, or iterations of a balance.
    uint count;
    uint stages;
    uint sensors;
    // Arithmetic nodes without arithmetic neighbours; their list follows the sensors.
    uint lone;
    // Start [s] since the heat was set.
    float time;
    // Length of a sub-step [s].
    float step;
    float space_temperature;
    // Weights of the rates at the end and at the start [s] and of the change in the estimate of the error.
    float error_end;
    float error_start;
    float error_change;
    // Turns of loops of a sub-step, and of one iteration of Newton's method. Some drivers end a shader's loops after
    // 65,535 turns in all.
    uint loops_sub_step;
    uint loops_iteration;
    // Nodes of the system that is solved by elimination, and where its parts begin in the schedule and in the matrix.
    uint unknowns;
    uint levels;
    uint nodes_at;
    uint entries_at;
    uint levels_at;
    uint targets_at;
    uint terms_at;
    uint pivots_at;
    uint uppers_at;
    uint fill_begin;
    uint fill_end;
    uint right_at;
};

// What one dispatch of the wide kernels and of the solver does.
struct NetworkPass {
    // Invocations that work; of SCALARS, workgroups that left a part.
    uint count;
    // Where the sensors of this sub-step lie.
    uint sensed_at;
    // Of UPDATE: 1 at a first iteration; of SCALARS: what it decides.
    uint mode;
    // Time of the stage [s] since the heat was set.
    float time;
    float space_temperature;
    // Weights of the stage; of the estimate of the error: of the change, none, of the rates at the end and at the start; of
    // a right side: of the heat now and at the start, and of the heat stored by the change and by that of the first stage.
    float mu;
    float nu;
    float mu_step;
    float gamma_step;
    // 1 / (alpha h) [1/s].
    float inverse_step;
    // Share of the first residual, squared, at which conjugate gradients stop; relative change of a temperature at which
    // Newton's method does, which after `mu` iterations may be four times as large.
    float accuracy;
};

// What the solver knows of itself.
struct NetworkSolver {
    // Present iteration of conjugate gradients: r z, step, what the solution moves by, and share of the last direction.
    float gamma;
    float alpha;
    float step;
    float beta;
    // r z of the first iteration, and of the first system of a stage.
    float gamma_start;
    float gamma_first;
    // Iterations, and whether more would change nothing.
    float gradients;
    float gradients_done;
    float newtons;
    float newtons_done;
    // Most iterations of one system and of one stage, and all.
    float most_gradients;
    float most_newtons;
    float iterations;
    // Whether too few iterations were recorded, and whether what came was no number.
    float short_gradients;
    float short_newtons;
    float lost;
    // Largest relative change of a temperature in the last iteration.
    float largest_move;
};
