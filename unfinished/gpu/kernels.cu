// Recurrent part of an LSTM with tanh and sigmoid, float32. Gates in the order input, forget, candidate, output.
__device__ __forceinline__ float sigm(float x) { return 1.0f / (1.0f + expf(-x)); }

#define KR 44            // rows of the recurrent kernel in registers, of 64 (forward)
#define KS 20
// One block per trajectory, 128 units, 256 threads: two lanes per unit, each with 4 gates x 64 rows.
extern "C" __global__ void __launch_bounds__(256, 1)
fwd128(const float* __restrict__ gx, const float* __restrict__ U, float* __restrict__ h_out, float* __restrict__ h_prev,
       float* __restrict__ act, float* __restrict__ c_out, int T, int save)
{
    extern __shared__ float4 ws[];                    // KS x 256
    __shared__ __align__(16) float hb[2][136];
    const int t = threadIdx.x, u = t >> 1, p = t & 1;
    const size_t b = blockIdx.x;
    float w[KR][4];
    #pragma unroll
    for (int k = 0; k < KR; k++)
        #pragma unroll
        for (int g = 0; g < 4; g++) w[k][g] = U[(p * 64 + k) * 512 + g * 128 + u];
    for (int k = 0; k < KS; k++) {
        const float* r = U + (p * 64 + KR + k) * 512 + u;
        ws[k * 256 + t] = make_float4(r[0], r[128], r[256], r[384]);
    }
    for (int i = t; i < 272; i += 256) (&hb[0][0])[i] = 0.0f;
    __syncthreads();
    float c = 0.0f;
    const float* gxb = gx + b * T * 512 + 2 * p * 128 + u;
    float x0 = gxb[0], x1 = gxb[128];
    float hlast = 0.0f;
    for (int s = 0; s < T; s++) {
        float n0 = 0.0f, n1 = 0.0f;
        if (s + 1 < T) { n0 = gxb[(s + 1) * 512]; n1 = gxb[(s + 1) * 512 + 128]; }
        const float4* h4 = (const float4*)(&hb[s & 1][p * 68]);
        float a[4] = {0.f, 0.f, 0.f, 0.f};
        #pragma unroll
        for (int k = 0; k < KR; k += 4) {
            float4 h = h4[k / 4];
            #pragma unroll
            for (int g = 0; g < 4; g++) {
                a[g] = fmaf(w[k][g], h.x, a[g]); a[g] = fmaf(w[k + 1][g], h.y, a[g]);
                a[g] = fmaf(w[k + 2][g], h.z, a[g]); a[g] = fmaf(w[k + 3][g], h.w, a[g]);
            }
        }
        #pragma unroll
        for (int k = 0; k < KS; k += 4) {
            float4 h = h4[(KR + k) / 4];
            float hv[4] = {h.x, h.y, h.z, h.w};
            #pragma unroll
            for (int q = 0; q < 4; q++) {
                float4 v = ws[(k + q) * 256 + t];
                a[0] = fmaf(v.x, hv[q], a[0]); a[1] = fmaf(v.y, hv[q], a[1]);
                a[2] = fmaf(v.z, hv[q], a[2]); a[3] = fmaf(v.w, hv[q], a[3]);
            }
        }
        float r0 = __shfl_xor_sync(0xffffffff, p ? a[0] : a[2], 1);
        float r1 = __shfl_xor_sync(0xffffffff, p ? a[1] : a[3], 1);
        float z0 = (p ? a[2] : a[0]) + r0 + x0, z1 = (p ? a[3] : a[1]) + r1 + x1;
        float a0 = p ? tanhf(z0) : sigm(z0), a1 = sigm(z1);
        float b0 = __shfl_xor_sync(0xffffffff, a0, 1), b1 = __shfl_xor_sync(0xffffffff, a1, 1);
        float gi = p ? b0 : a0, gf = p ? b1 : a1, gg = p ? a0 : b0, go = p ? a1 : b1;
        c = gf * c + gi * gg;
        float h = go * tanhf(c);
        const size_t row = b * T + s;
        if (p == 0) {
            hb[(s + 1) & 1][(u >> 6) * 68 + (u & 63)] = h;
            h_out[row * 128 + u] = h;
            if (save) h_prev[row * 128 + u] = hlast;
        } else if (save) c_out[row * 128 + u] = c;
        if (save) { act[row * 512 + 2 * p * 128 + u] = a0; act[row * 512 + (2 * p + 1) * 128 + u] = a1; }
        hlast = h; x0 = n0; x1 = n1;
        __syncthreads();
    }
}

#define JR 176
#define JS 20            // times four
extern "C" __global__ void __launch_bounds__(256, 1)
bwd128(const float* __restrict__ dh_out, const float* __restrict__ U, const float* __restrict__ act,
       const float* __restrict__ c_out, float* __restrict__ dz, int T)
{
    extern __shared__ float4 ws[];                    // JS x 256
    __shared__ __align__(16) float zb[2][520];
    const int t = threadIdx.x, u = t >> 1, p = t & 1;
    const size_t b = blockIdx.x;
    float w[JR];
    const float* r = U + u * 512 + p * 256;
    #pragma unroll
    for (int j = 0; j < JR; j++) w[j] = r[j];
    for (int i = 0; i < JS; i++) ws[i * 256 + t] = make_float4(r[JR + 4 * i], r[JR + 4 * i + 1], r[JR + 4 * i + 2], r[JR + 4 * i + 3]);
    __syncthreads();
    float dhrec = 0.0f, dcn = 0.0f;
    size_t row = b * T + T - 1;
    float gi = act[row * 512 + u], gf = act[row * 512 + 128 + u], gg = act[row * 512 + 256 + u], go = act[row * 512 + 384 + u];
    float c = c_out[row * 128 + u], dho = dh_out[row * 128 + u];
    for (int s = T - 1; s >= 0; s--) {
        row = b * T + s;
        float ni = 0, nf = 0, ng = 0, no = 0, cp = 0, ndh = 0;
        if (s > 0) {
            const size_t q = row - 1;
            ni = act[q * 512 + u]; nf = act[q * 512 + 128 + u]; ng = act[q * 512 + 256 + u]; no = act[q * 512 + 384 + u];
            cp = c_out[q * 128 + u]; ndh = dh_out[q * 128 + u];
        }
        float dh = dho + dhrec, tc = tanhf(c);
        float dc = dcn + dh * go * (1.0f - tc * tc);
        float z0, z1;
        if (p == 0) { z0 = dc * gg * gi * (1.0f - gi); z1 = dc * cp * gf * (1.0f - gf); }
        else { z0 = dc * gi * (1.0f - gg * gg); z1 = dh * tc * go * (1.0f - go); }
        dcn = dc * gf;
        float* z = zb[s & 1];
        z[p * 260 + u] = z0; z[p * 260 + 128 + u] = z1;
        dz[row * 512 + p * 256 + u] = z0; dz[row * 512 + p * 256 + 128 + u] = z1;
        __syncthreads();
        const float4* z4 = (const float4*)(z + p * 260);
        float a[4] = {0.f, 0.f, 0.f, 0.f};
        #pragma unroll
        for (int j = 0; j < JR; j += 4) {
            float4 v = z4[j / 4];
            a[0] = fmaf(w[j], v.x, a[0]); a[1] = fmaf(w[j + 1], v.y, a[1]);
            a[2] = fmaf(w[j + 2], v.z, a[2]); a[3] = fmaf(w[j + 3], v.w, a[3]);
        }
        #pragma unroll
        for (int i = 0; i < JS; i++) {
            float4 v = z4[JR / 4 + i], q = ws[i * 256 + t];
            a[0] = fmaf(q.x, v.x, a[0]); a[1] = fmaf(q.y, v.y, a[1]);
            a[2] = fmaf(q.z, v.z, a[2]); a[3] = fmaf(q.w, v.w, a[3]);
        }
        float sum = (a[0] + a[1]) + (a[2] + a[3]);
        dhrec = sum + __shfl_xor_sync(0xffffffff, sum, 1);
        gi = ni; gf = nf; gg = ng; go = no; c = cp; dho = ndh;
    }
}

// 256 units: a cluster of 8 blocks holds the recurrent kernel in registers, and takes 4 trajectories at once.
__device__ __forceinline__ unsigned smem(const void* p) { return (unsigned)__cvta_generic_to_shared(p); }
__device__ __forceinline__ unsigned remote(unsigned a, unsigned r) {
    unsigned d; asm volatile("mapa.shared::cluster.u32 %0, %1, %2;" : "=r"(d) : "r"(a), "r"(r)); return d;
}
__device__ __forceinline__ void put(unsigned a, float v) {
    asm volatile("st.shared::cluster.f32 [%0], %1;" :: "r"(a), "f"(v) : "memory");
}
__device__ __forceinline__ void meet() {
    asm volatile("barrier.cluster.arrive.release.aligned;\n\tbarrier.cluster.wait.acquire.aligned;" ::: "memory");
}
__device__ __forceinline__ unsigned rank_of() { unsigned r; asm volatile("mov.u32 %0, %%cluster_ctarank;" : "=r"(r)); return r; }

#define HE 288           // 8 slices of 32 units, each padded to 36
extern "C" __global__ void __cluster_dims__(8, 1, 1) __launch_bounds__(256, 1)
fwd256(const float* __restrict__ gx, const float* __restrict__ U, float* __restrict__ h_out, float* __restrict__ h_prev,
       float* __restrict__ act, float* __restrict__ c_out, int T, int save)
{
    __shared__ __align__(16) float hb[2][4][HE];
    const int t = threadIdx.x, u = t >> 3, s8 = t & 7, e = s8 >> 1, q = s8 & 1;
    const unsigned rank = rank_of();
    const int ug = rank * 32 + u;
    const size_t b = (blockIdx.x >> 3) * 4 + e;
    float w[32][4];
    #pragma unroll
    for (int k = 0; k < 32; k++)
        #pragma unroll
        for (int g = 0; g < 4; g++) w[k][g] = U[(s8 * 32 + k) * 1024 + g * 256 + ug];
    for (int i = t; i < 2 * 4 * HE; i += 256) (&hb[0][0][0])[i] = 0.0f;
    unsigned to[4];
    #pragma unroll
    for (int r = 0; r < 4; r++) to[r] = remote(smem(&hb[0][e][rank * 36 + u]), q * 4 + r);
    meet();
    float c = 0.0f, hlast = 0.0f;
    const float* gxb = gx + b * T * 1024 + 2 * q * 256 + ug;
    float x0 = gxb[0], x1 = gxb[256];
    for (int s = 0; s < T; s++) {
        float n0 = 0.0f, n1 = 0.0f;
        if (s + 1 < T) { n0 = gxb[(s + 1) * 1024]; n1 = gxb[(s + 1) * 1024 + 256]; }
        float a[4][4];
        #pragma unroll
        for (int i = 0; i < 4; i++)
            #pragma unroll
            for (int g = 0; g < 4; g++) a[i][g] = 0.0f;
        const float (*hs)[HE] = hb[s & 1];
        #pragma unroll
        for (int k = 0; k < 32; k += 4)
            #pragma unroll
            for (int i = 0; i < 4; i++) {
                float4 h = *(const float4*)(&hs[i][s8 * 36 + k]);
                #pragma unroll
                for (int g = 0; g < 4; g++) {
                    a[i][g] = fmaf(w[k][g], h.x, a[i][g]); a[i][g] = fmaf(w[k + 1][g], h.y, a[i][g]);
                    a[i][g] = fmaf(w[k + 2][g], h.z, a[i][g]); a[i][g] = fmaf(w[k + 3][g], h.w, a[i][g]);
                }
            }
        // Sum over the eight lanes; each keeps two gates of one trajectory.
        const bool hi = s8 & 4, mid = s8 & 2;
        float m[2][4], n[4];
        #pragma unroll
        for (int i = 0; i < 2; i++)
            #pragma unroll
            for (int g = 0; g < 4; g++) {
                float give = hi ? a[i][g] : a[i + 2][g], keep = hi ? a[i + 2][g] : a[i][g];
                m[i][g] = keep + __shfl_xor_sync(0xffffffff, give, 4);
            }
        #pragma unroll
        for (int g = 0; g < 4; g++) {
            float give = mid ? m[0][g] : m[1][g], keep = mid ? m[1][g] : m[0][g];
            n[g] = keep + __shfl_xor_sync(0xffffffff, give, 2);
        }
        float z0 = (q ? n[2] : n[0]) + __shfl_xor_sync(0xffffffff, q ? n[0] : n[2], 1) + x0;
        float z1 = (q ? n[3] : n[1]) + __shfl_xor_sync(0xffffffff, q ? n[1] : n[3], 1) + x1;
        float a0 = q ? tanhf(z0) : sigm(z0), a1 = sigm(z1);
        float b0 = __shfl_xor_sync(0xffffffff, a0, 1), b1 = __shfl_xor_sync(0xffffffff, a1, 1);
        float gi = q ? b0 : a0, gf = q ? b1 : a1, gg = q ? a0 : b0, go = q ? a1 : b1;
        c = gf * c + gi * gg;
        float h = go * tanhf(c);
        const unsigned off = ((s + 1) & 1) * 4 * HE * 4;
        #pragma unroll
        for (int r = 0; r < 4; r++) put(to[r] + off, h);
        const size_t row = b * T + s;
        if (q == 0) {
            h_out[row * 256 + ug] = h;
            if (save) h_prev[row * 256 + ug] = hlast;
        } else if (save) c_out[row * 256 + ug] = c;
        if (save) { act[row * 1024 + 2 * q * 256 + ug] = a0; act[row * 1024 + (2 * q + 1) * 256 + ug] = a1; }
        hlast = h; x0 = n0; x1 = n1;
        meet();
    }
}

#define PS 148           // partial sums of one source: 4 trajectories of 32 units, each padded to 36, and 4
extern "C" __global__ void __cluster_dims__(8, 1, 1) __launch_bounds__(256, 1)
bwd256(const float* __restrict__ dh_out, const float* __restrict__ U, const float* __restrict__ act,
       const float* __restrict__ c_out, float* __restrict__ dz, int T)
{
    __shared__ __align__(16) float zb[4][128];
    __shared__ __align__(16) float part[2][8 * PS];
    const int t = threadIdx.x, u = t >> 3, s8 = t & 7, e = s8 >> 1, q = s8 & 1;
    const unsigned rank = rank_of();
    const int ug = rank * 32 + u;
    const size_t b = (blockIdx.x >> 3) * 4 + e;
    float w[128];
    #pragma unroll
    for (int g = 0; g < 4; g++)
        #pragma unroll
        for (int i = 0; i < 32; i++) w[g * 32 + i] = U[t * 1024 + g * 256 + rank * 32 + i];
    const unsigned to = remote(smem(&part[0][rank * PS + (t & 31)]), t >> 5);
    meet();
    float dcn = 0.0f;
    size_t row = b * T + T - 1;
    float gi = act[row * 1024 + ug], gf = act[row * 1024 + 256 + ug], gg = act[row * 1024 + 512 + ug], go = act[row * 1024 + 768 + ug];
    float c = c_out[row * 256 + ug], dho = dh_out[row * 256 + ug];
    for (int s = T - 1; s >= 0; s--) {
        row = b * T + s;
        float ni = 0, nf = 0, ng = 0, no = 0, cp = 0, ndh = 0;
        if (s > 0) {
            const size_t v = row - 1;
            ni = act[v * 1024 + ug]; nf = act[v * 1024 + 256 + ug]; ng = act[v * 1024 + 512 + ug]; no = act[v * 1024 + 768 + ug];
            cp = c_out[v * 256 + ug]; ndh = dh_out[v * 256 + ug];
        }
        float dh = dho;
        if (s < T - 1) {
            const float* from = &part[s & 1][q * 4 * PS + e * 36 + u];
            float sum = (from[0] + from[PS]) + (from[2 * PS] + from[3 * PS]);
            dh += sum + __shfl_xor_sync(0xffffffff, sum, 1);
        }
        float tc = tanhf(c);
        float dc = dcn + dh * go * (1.0f - tc * tc);
        float z0, z1;
        if (q == 0) { z0 = dc * gg * gi * (1.0f - gi); z1 = dc * cp * gf * (1.0f - gf); }
        else { z0 = dc * gi * (1.0f - gg * gg); z1 = dh * tc * go * (1.0f - go); }
        dcn = dc * gf;
        zb[e][2 * q * 32 + u] = z0; zb[e][(2 * q + 1) * 32 + u] = z1;
        dz[row * 1024 + 2 * q * 256 + ug] = z0; dz[row * 1024 + (2 * q + 1) * 256 + ug] = z1;
        if (s == 0) break;
        __syncthreads();
        float a[4] = {0.f, 0.f, 0.f, 0.f};
        #pragma unroll
        for (int j = 0; j < 128; j += 4)
            #pragma unroll
            for (int i = 0; i < 4; i++) {
                float4 v = *(const float4*)(&zb[i][j]);
                a[i] = fmaf(w[j], v.x, a[i]); a[i] = fmaf(w[j + 1], v.y, a[i]);
                a[i] = fmaf(w[j + 2], v.z, a[i]); a[i] = fmaf(w[j + 3], v.w, a[i]);
            }
        const unsigned off = ((s - 1) & 1) * 8 * PS * 4;
        #pragma unroll
        for (int i = 0; i < 4; i++) put(to + off + i * 36 * 4, a[i]);
        gi = ni; gf = nf; gg = ng; go = no; c = cp; dho = ndh;
        meet();
    }
}

// Causal convolution: columns (row, k, c) of the sequence shifted by (K - 1 - k) * dilation steps.
extern "C" __global__ void im2col(const float* __restrict__ x, float* __restrict__ cols, int T, int C, int d, int total)
{
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= total) return;
    int c = i % C, k = (i / C) % 3, row = i / (3 * C), s = row % T - (2 - k) * d;
    cols[i] = s >= 0 ? x[(row - (2 - k) * d) * C + c] : 0.0f;
}
extern "C" __global__ void col2im(const float* __restrict__ dcols, float* __restrict__ dx, int T, int C, int d, int total)
{
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= total) return;
    int c = i % C, row = i / C, s = row % T;
    float v = 0.0f;
    #pragma unroll
    for (int k = 0; k < 3; k++) {
        int o = (2 - k) * d;
        if (s + o < T) v += dcols[((row + o) * 3 + k) * C + c];
    }
    dx[i] = v;
}
// Adam as Keras computes it.
extern "C" __global__ void adam(float* __restrict__ w, const float* __restrict__ g, float* __restrict__ m, float* __restrict__ v,
                                const float* __restrict__ rate, const int* __restrict__ steps, int total)
{
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= total) return;
    float n = (float)(*steps + 1);
    float alpha = *rate * sqrtf(1.0f - powf(0.999f, n)) / (1.0f - powf(0.9f, n));
    float gi = g[i], mi = m[i] + (gi - m[i]) * (1.0f - 0.9f), vi = v[i] + (gi * gi - v[i]) * (1.0f - 0.999f);
    m[i] = mi; v[i] = vi;
    w[i] -= mi * alpha / (sqrtf(vi) + 1e-7f);
}
