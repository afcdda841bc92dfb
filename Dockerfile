# Linefix as an image: the wheel with its pinned dependencies and kernels compiled ahead, run by a user without rights.
#   docker build -t linefix .
#   docker run --rm --read-only -p 127.0.0.1:8000:8000 -v linefix:/data -e LINEFIX_ALLOW_ANONYMOUS=1 linefix
# For x86-64 and arm64: docker buildx build --platform linux/amd64,linux/arm64 -t linefix .
ARG BASE_IMAGE=python:3.13-slim

FROM ${BASE_IMAGE} AS build
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /src
# Bytecode is compiled to be used unchecked: copying changes the files' times, and every start would compile it again.
ENV COMPILE="/opt/linefix/bin/python -m compileall -q -j 0 --invalidation-mode unchecked-hash"
# The dependencies alone first: a change of the code does not install them again. Wheels alone, each with its hash, so
# that nothing of a package is run to install it; on arm64 but for Cyclone DDS. Then what never runs goes: their tests,
# sources, headers, stubs.
COPY requirements/build.txt requirements/runtime.txt requirements/
COPY deploy/cyclonedds-on-arm64 deploy/
RUN python3 -m venv /opt/tools \
    && /opt/tools/bin/pip install --quiet --require-hashes --only-binary :all: --requirement requirements/build.txt \
    && python3 -m venv --without-pip /opt/linefix \
    && sh deploy/cyclonedds-on-arm64 \
    && /opt/tools/bin/pip --python /opt/linefix/bin/python \
        install --quiet --no-compile --require-hashes --only-binary :all: --requirement requirements/runtime.txt \
    && find /opt/linefix/lib -depth -type d \( -name tests -o -name test \) -exec rm -r {} + \
    && find /opt/linefix/lib -type f \
        \( -name '*.pyi' -o -name '*.pyx' -o -name '*.pxd' -o -name '*.[ach]' -o -name '*.[ch]pp' \) -delete \
    && $COMPILE /opt/linefix/lib
COPY .ci/materials.py .ci/
COPY pyproject.toml README.md ./
COPY compiled compiled
COPY registration registration
COPY vectorization vectorization
COPY association association
COPY simulation simulation
COPY formats formats
COPY map_quality map_quality
COPY batch batch
COPY linefix linefix
COPY ros2 ros2
COPY service service
COPY cli cli
COPY clients/python clients/python
# Given the time of a commit, the wheel is that of `make wheel`, to the byte.
ARG SOURCE_DATE_EPOCH
RUN /opt/tools/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /wheels . ./clients/python \
    && /opt/tools/bin/pip --python /opt/linefix/bin/python install --quiet --no-compile --no-deps /wheels/*.whl \
    && /opt/tools/bin/python .ci/materials.py /opt/linefix/sbom.cdx.json /opt/linefix/bin/python \
    && find /opt/linefix/bin -mindepth 1 ! -name 'python*' ! -name linefix -delete \
    && rm -rf /opt/linefix/include /opt/linefix/share
# Kernels for any processor of its kind, x86-64 or arm64. Its name is part of their digest, so it is the same at run time.
ENV LINEFIX_KERNELS=/opt/linefix/kernels NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES=""
WORKDIR /
RUN PYTHONDONTWRITEBYTECODE=1 /opt/linefix/bin/python -c "from linefix.compiling import compile_kernels; compile_kernels()"
RUN cd "$(/opt/linefix/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" \
    && $COMPILE compiled registration vectorization association simulation formats map_quality batch linefix ros2 service cli linefix_client \
    && chmod -R u=rwX,go=rX /opt/linefix

FROM ${BASE_IMAGE}
LABEL org.opencontainers.image.title="Linefix" \
      org.opencontainers.image.description="Tells a robot where it is from line segments, and says when it cannot"
# No program of the base gives rights to who runs it, and nothing installs anything.
RUN useradd --system --uid 10001 --user-group --home-dir /data --no-create-home --shell /usr/sbin/nologin linefix \
    && install --directory --owner=linefix --group=linefix --mode=0750 /data \
    && find / -xdev -type f -perm /6000 -exec chmod a-s {} + \
    && rm -rf /usr/local/bin/pip* /usr/local/lib/python3*/ensurepip /usr/local/lib/python3*/site-packages/pip*
COPY --from=build /opt/linefix /opt/linefix
# On arm64: the C library of Cyclone DDS.
RUN if [ -e /opt/linefix/packages ]; then \
        apt-get update --quiet && xargs apt-get install --yes --quiet --no-install-recommends < /opt/linefix/packages \
        && rm -rf /var/lib/apt/lists/*; \
    fi
ENV PATH=/opt/linefix/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    LINEFIX_KERNELS=/opt/linefix/kernels \
    NUMBA_CPU_NAME=generic \
    NUMBA_CPU_FEATURES="" \
    LINEFIX_HOST=0.0.0.0 \
    LINEFIX_PORT=8000 \
    LINEFIX_DATA_DIR=/data
# Once through as at a start: leaves the bytecode of what is used of Python itself, which its slim image comes without.
RUN python -c "import uvicorn.protocols.http.h11_impl, uvloop, service.serving, service.app; from linefix.warmup import warm_up; warm_up()"
ENV PYTHONDONTWRITEBYTECODE=1
USER linefix
WORKDIR /data
VOLUME /data
EXPOSE 8000
# Without keys (LINEFIX_KEYS) it refuses to start, unless LINEFIX_ALLOW_ANONYMOUS=1 lets everyone in who reaches the port.
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as u; u.urlopen(f\"http://127.0.0.1:{os.environ['LINEFIX_PORT']}/readyz\", timeout=2)"]
ENTRYPOINT ["linefix", "serve"]
