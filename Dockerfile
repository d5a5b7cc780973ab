# The studio in a container:
#
#   docker build --tag motorcade .
#   docker run --rm --publish 127.0.0.1:7700:7700 --volume motorcade:/home/motorcade/projects motorcade
#
# Open the address that it prints, with localhost in place of the container's own. The token in it lets you in.
# 127.0.0.1 in --publish keeps it to this computer, so --insecure-lan is safe here. Others in the network need HTTPS:
# docker run … --publish 7700:7700 --volume ./keys:/keys motorcade studio --host 0.0.0.0 --https /keys/car-desk.pem

FROM python:3.13-slim-bookworm AS build
WORKDIR /source
COPY . .
# The build hook makes the page with the Node that comes as a Python package.
RUN python -m pip install --no-cache-dir build==1.6.1 \
    && python -m build --wheel --outdir /wheels \
    # The versions of the lock, without hashes: pip takes none in a list of constraints.
    && sed -e '/^ *--hash=/d' -e 's/ \\$//' requirements-dev.lock > /wheels/constraints.txt

FROM python:3.13-slim-bookworm
RUN useradd --create-home motorcade
COPY --from=build /wheels /wheels
RUN python -m pip install --no-cache-dir --constraint /wheels/constraints.txt \
        "$(echo /wheels/motorcade-*.whl)[studio,sim,drive]" \
    && rm -r /wheels
USER motorcade
WORKDIR /home/motorcade
RUN mkdir projects
EXPOSE 7700
ENTRYPOINT ["motorcade"]
CMD ["studio", "--host", "0.0.0.0", "--insecure-lan", "--no-browser", "--library", "/home/motorcade/projects"]
